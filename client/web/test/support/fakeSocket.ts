import type { WebSocketLike } from "../../src/net/link";
import type { ClientMessage } from "../../src/net/messages";
import { decodePacket } from "../../src/net/packet";

/** A socket whose other end is the test. */
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
  open(): void {
    this.onopen?.(undefined as never);
  }
  tell(packet: Uint8Array): void {
    this.onmessage?.({ data: packet.buffer.slice(packet.byteOffset, packet.byteOffset + packet.length) });
  }
  get said(): ClientMessage[] {
    return this.sent.map((packet) => decodePacket(packet).message as ClientMessage);
  }
  get saidTypes(): string[] {
    return this.said.map((message) => message.type);
  }
}
