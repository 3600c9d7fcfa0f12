/** The settings in the page's address. */
export interface Query {
  /** empty: the lobby */
  readonly room: string;
  /** by default the one that the page names, see `pageServer`, or else the one that served the page */
  readonly server: string;
  readonly token: string;
  /** watch only */
  readonly observe: boolean;
}

/**
 * The server that a page names in its head: `<meta name="hairnet-server" content="wss://...">`. `deploy/web --static`
 * writes it, for a page that another web server hands out. Empty without it.
 */
export function pageServer(page: Document): string {
  return page.querySelector<HTMLMetaElement>('meta[name="hairnet-server"]')?.content ?? "";
}

/** Reads `?room=&server=&token=&observe`. */
export function readQuery(address: URL, namedServer = ""): Query {
  const asked = address.searchParams;
  const observe = asked.get("observe");
  return {
    room: asked.get("room") ?? "",
    server: asked.get("server") || namedServer || address.origin,
    token: asked.get("token") ?? "",
    observe: observe !== null && observe !== "0" && observe !== "false",
  };
}
