import type { WebSocketLike } from "../../src/net/socket";

/**
 * A socket whose other end is the test: `open` and `break` call what the code under test listens with, and `sent` has
 * what that code sent. `WebSocketLike` (src/net/socket.ts) explains the members.
 */
export class FakeSocket implements WebSocketLike {
  binaryType = "blob";
  bufferedAmount = 0;
  onopen: ((event: never) => unknown) | null = null;
  onmessage: ((event: { readonly data: unknown }) => unknown) | null = null;
  onerror: ((event: never) => unknown) | null = null;
  onclose: ((event: { readonly code: number; readonly reason: string }) => unknown) | null = null;
  readonly sent: Uint8Array[] = [];
  closed = false;

  send(bytes: Uint8Array): void {
    this.sent.push(bytes);
  }
  close(): void {
    this.closed = true;
  }
  /** The connection is open. */
  open(): void {
    this.onopen?.(undefined as never);
  }
  /** The connection ends without a closing handshake, for which browsers report the code 1006. */
  break(reason = ""): void {
    this.onclose?.({ code: 1006, reason });
  }
}
