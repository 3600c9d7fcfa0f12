import { ErrorClass, LevelIndex } from "../../src/hair/level";
import { Link, type WebSocketLike } from "../../src/net/link";
import type { ClientMessage, ServerMessage, Welcome } from "../../src/net/messages";
import { decodePacket } from "../../src/net/packet";
import { Room } from "../../src/room/index";
import { LinkCoreDriver } from "./linkCoreDriver";
import { serverPacket } from "./serverPacket";

const kSecond = 1e9;

/** A room whose server sends what the test wants. */
export class ServedRoom {
  nowNs = 100 * kSecond;
  readonly sockets: FakeSocket[] = [];
  readonly link = new Link("localhost:7420", {
    makeSocket: () => {
      this.sockets.push(new FakeSocket());
      return this.sockets[this.sockets.length - 1];
    },
    nowNs: () => this.nowNs,
    random: () => 0.5,
  });
  readonly room = new Room(this.link);

  constructor() {
    void this.link.connect();
    this.welcome();
  }

  /** Accepts the connection that the link has opened. */
  welcome(more: Partial<Welcome> = {}): void {
    this.socket.onopen?.(undefined as never);
    this.receive(new LinkCoreDriver().welcome(more));
  }

  /** Breaks the connection; the link opens another. */
  reconnect(more: Partial<Welcome> = {}): void {
    this.socket.onclose?.({ code: 1006, reason: "" });
    while (this.sockets.length < 2 || this.socket.isWelcomed) {
      this.nowNs += kSecond;
      this.link.flush();
    }
    this.welcome(more);
  }

  get socket(): FakeSocket {
    return this.sockets[this.sockets.length - 1];
  }
  receive(message: ServerMessage): void {
    const packet = serverPacket(this.nowNs, message);
    this.socket.isWelcomed = true;
    this.socket.onmessage?.({ data: packet.buffer.slice(packet.byteOffset, packet.byteOffset + packet.length) });
  }
  sent(): ClientMessage[] {
    return this.socket.sent.splice(0).map((packet) => decodePacket(packet).message as ClientMessage);
  }
  /** A rigid frame at the origin, after which no other comes. */
  receiveAsleep(member: number): void {
    const frame = {
      member,
      level: LevelIndex.rigid,
      errorClass: ErrorClass.halfMm,
      discontinuous: false,
      asleep: true,
    };
    const rest = { velocities: false, order: 0, stride: 1, stepStride: 1, content: rigidContent() };
    this.receive({ type: "frameBatch", tick: 1, sampleTimeNs: this.nowNs, frames: [{ ...frame, ...rest }] });
  }
}

class FakeSocket implements WebSocketLike {
  binaryType = "blob";
  bufferedAmount = 0;
  onopen: ((event: never) => unknown) | null = null;
  onmessage: ((event: { readonly data: unknown }) => unknown) | null = null;
  onerror: ((event: never) => unknown) | null = null;
  onclose: ((event: { readonly code: number; readonly reason: string }) => unknown) | null = null;
  readonly sent: Uint8Array[] = [];
  isWelcomed = false;
  send(bytes: Uint8Array): void {
    this.sent.push(bytes);
  }
  close(): void {}
}

/** Choices 0; then for each bone: largest is w (3), positive; six zeros and the largest's own, each of one bit. */
function rigidContent(): Uint8Array {
  const bits: number[] = new Array(14).fill(0);
  for (let bone = 0; bone < 5; ++bone) bits.push(1, 1, 0, 1, 1, 1, 1, 1, 1, 1);
  const bytes = new Uint8Array(Math.ceil(bits.length / 8));
  for (const [i, bit] of bits.entries()) bytes[i >> 3] |= bit << (i & 7);
  return bytes;
}
