/** The text that `keep` has stored under this key in this browser, maybe for an earlier page; "": none. */
export function kept(key: string): string {
  try {
    return localStorage.getItem(key) ?? "";
  } catch {
    // The browser throws where its storage is switched off.
    return "";
  }
}

/** Stores a text in this browser for later pages. */
export function keep(key: string, value: string): void {
  try {
    localStorage.setItem(key, value);
  } catch {
    // Storage is switched off or full. The caller's value lasts as long as the page.
  }
}
