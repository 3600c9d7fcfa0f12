/** The settings in the page's address. */
export interface Query {
  /** empty: the lobby */
  readonly room: string;
  /** by default the server that served the page */
  readonly server: string;
  readonly token: string;
  /** watch only */
  readonly observe: boolean;
}

/** Reads `?room=&server=&token=&observe`. */
export function readQuery(address: URL): Query {
  const asked = address.searchParams;
  const observe = asked.get("observe");
  return {
    room: asked.get("room") ?? "",
    server: asked.get("server") || address.origin,
    token: asked.get("token") ?? "",
    observe: observe !== null && observe !== "0" && observe !== "false",
  };
}
