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
  /** absent: a WebSocket */
  readonly transport?: Transport;
  /** why it is not WebTransport, which was tried before, in one line; null or absent: it is, or that was not tried */
  readonly fallbackReason?: string | null;
  /** Sends a packet that may get lost or overtake others. False: it was not taken; absent: there are no datagrams. */
  sendDatagram?(bytes: Uint8Array): boolean;
  /** Told of an open socket that is better than this open one; who is told uses or closes it. Absent: there never is. */
  onbetter?: ((socket: WebSocketLike) => unknown) | null;
}
