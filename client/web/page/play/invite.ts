/** The room that a page shows. */
export interface ShownRoom {
  /** The name of the room; empty: the lobby. */
  readonly room: string;
  readonly server: string;
  readonly token: string;
}

/** A link to this room. A token stays out of it: it says who its holder is. */
export function inviteLink(page: URL, query: ShownRoom): URL {
  const link = new URL(page.pathname, page.origin);
  if (query.room) link.searchParams.set("room", query.room);
  if (new URL(query.server).host !== page.host) link.searchParams.set("server", query.server);
  return link;
}

/** What a friend needs to know beside the link; empty: nothing. */
export function inviteNote(link: URL, query: ShownRoom): string {
  if (/^(localhost|127\.\d+\.\d+\.\d+|\[::1\])$/.test(link.hostname))
    return "This address works on this machine only. Start the server with --bind to let others in.";
  return query.token ? "This room needs a token: your friend needs one too." : "";
}
