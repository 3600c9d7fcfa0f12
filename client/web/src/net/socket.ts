/** How packets travel. */
export type Transport = "webtransport" | "websocket";

/** What a room needs of a WebSocket: browsers' own, or another's for tests and Node. */
export interface WebSocketLike {
  binaryType: string;
  readonly bufferedAmount: number;
  onopen: ((event: never) => unknown) | null;
  onmessage: ((event: { readonly data: unknown }) => unknown) | null;
  onerror: ((event: never) => unknown) | null;
  onclose: ((event: { readonly code: number; readonly reason: string }) => unknown) | null;
  send(bytes: Uint8Array): void;
  close(): void;
  /** How this socket's packets travel; absent: it is a WebSocket. */
  readonly transport?: Transport;
  /**
   * Why the socket is not a WebTransport session, which was tried before, in one line. Null or absent: it is a session,
   * or none was tried.
   */
  readonly fallbackReason?: string | null;
  /**
   * Sends a packet as a datagram, which may get lost or overtake others. Returns false if the packet must go over
   * `send`. Absent: there are no datagrams.
   */
  sendDatagram?(bytes: Uint8Array): boolean;
  /**
   * Called with another open socket that is better than this one. The listener uses or closes it. Absent: this socket
   * never looks for a better one.
   */
  onbetter?: ((socket: WebSocketLike) => unknown) | null;
}
