import type { Page } from "playwright-core";

/** Drops files on the page, as from a folder of the desktop. */
export function dropFiles(
  page: Page,
  ...files: readonly (readonly [name: string, bytes: Uint8Array])[]
): Promise<void> {
  const texts = files.map(([name, bytes]) => [name, Buffer.from(bytes).toString("base64")] as const);
  return page.evaluate((given) => {
    const data = new DataTransfer();
    for (const [name, text] of given)
      data.items.add(new File([Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0))], name));
    dispatchEvent(new DragEvent("drop", { dataTransfer: data, bubbles: true, cancelable: true }));
  }, texts);
}
