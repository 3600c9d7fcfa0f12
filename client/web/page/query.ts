/** The settings in the page's address. */
export interface Query {
  /** The name of the room; empty: the lobby. */
  readonly room: string;
  /** The server's address. By default it is what the page names (`pageServer`), or else the server of the page. */
  readonly server: string;
  readonly token: string;
  /** The user only watches, and has no hair. */
  readonly observe: boolean;
  /** This browser simulates the hair itself, without a server. */
  readonly local: boolean;
}

/** What a page names in place of a server when it simulates the hair itself. */
const kNone = "none";

/**
 * The server that a page names in its head: `<meta name="hairnet-server" content="wss://...">`. `deploy/web --static`
 * writes it, for a page that another web server hands out: "none" where there is no server. Empty without it.
 */
export function pageServer(page: Document): string {
  return page.querySelector<HTMLMetaElement>('meta[name="hairnet-server"]')?.content ?? "";
}

/** Reads `?room=&server=&token=&observe&local`. */
export function readQuery(address: URL, namedServer = ""): Query {
  const asked = address.searchParams;
  const is = (name: string) => ![null, "0", "false"].includes(asked.get(name));
  const server = asked.get("server") || namedServer;
  const local = is("local") || server === kNone;
  return {
    room: asked.get("room") ?? "",
    server: local ? address.origin : server || address.origin,
    token: asked.get("token") ?? "",
    // A room without a server has nobody to watch, so its user is never an observer.
    observe: is("observe") && !local,
    local,
  };
}
