import { HairnetError } from "../module/hairnetError";

/**
 * The WebSocket address of a server. `server` is "host:port", a page's http(s) address, or a ws(s) address. The path is
 * /ws unless a ws(s) address has another one.
 */
export function webSocketUrl(server: string): string {
  let url: URL;
  try {
    if (typeof server !== "string" || server === "") throw new TypeError("no text");
    url = new URL(/^[a-z]+:\/\//i.test(server) ? server : `ws://${server}`);
  } catch {
    throw new HairnetError("invalid", `"${String(server)}" is no address of a server, like "ws://localhost:7420"`);
  }
  const schemes: Record<string, string> = { "http:": "ws:", "https:": "wss:", "ws:": "ws:", "wss:": "wss:" };
  const scheme = schemes[url.protocol];
  if (!scheme) throw new HairnetError("invalid", `"${server}" begins with neither ws(s):// nor http(s)://`);
  const path = url.protocol.startsWith("ws") && url.pathname !== "/" ? url.pathname : "/ws";
  return `${scheme}//${url.host}${path}`;
}

/** The address `home` at another host and port. Throws `TypeError` for a text that is no host. */
export function urlAt(home: string, host: string, port: number): string {
  const { protocol, pathname } = new URL(home);
  return new URL(`${protocol}//${host.includes(":") ? `[${host}]` : host}:${port}${pathname}`).href;
}

/** The host and port of an address, as people name a server: with the port also where it is the scheme's own. */
export function hostAndPort(url: string): string {
  const { hostname, port, protocol } = new URL(url);
  return `${hostname}:${port || (protocol === "wss:" || protocol === "https:" ? 443 : 80)}`;
}
