import { LevelIndex } from "../../src/hair/level";
import { Link } from "../../src/net/link";
import type { ClientMessage, ServerMessage, Welcome } from "../../src/net/messages";
import { decodePacket } from "../../src/net/packet";
import { Room, type RoomOptions } from "../../src/room/index";
import { FakeSocket } from "./fakeSocket";
import { LinkCoreDriver } from "./linkCoreDriver";
import { rigidContent } from "./rigidContent";
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
  readonly room: Room;

  constructor({ errorM }: Pick<RoomOptions, "errorM"> = {}) {
    this.room = new Room(this.link, errorM);
    void this.link.connect();
    this.welcome();
  }

  /** Accepts the connection that the link has opened. */
  welcome(more: Partial<Welcome> = {}): void {
    this.socket.open();
    this.receive(new LinkCoreDriver().welcome(more));
  }

  /** Breaks the connection; the link opens another. */
  reconnect(more: Partial<Welcome> = {}): void {
    this.socket.onclose?.({ code: 1006, reason: "" });
    for (const before = this.socket; this.socket === before; ) {
      this.nowNs += kSecond;
      this.link.flush();
    }
    this.welcome(more);
  }

  get socket(): FakeSocket {
    return this.sockets[this.sockets.length - 1];
  }
  receive(message: ServerMessage): void {
    this.socket.tell(serverPacket(this.nowNs, message));
  }
  sent(): ClientMessage[] {
    return this.socket.sent.splice(0).map((packet) => decodePacket(packet).message as ClientMessage);
  }
  /** A rigid frame at the origin, after which no other comes. */
  receiveAsleep(member: number): void {
    const frame = {
      member,
      level: LevelIndex.rigid,
      discontinuous: false,
      asleep: true,
      evaluated: false,
      stepStride: 1,
    };
    const frames = [{ ...frame, content: rigidContent() }];
    this.receive({ type: "frameBatch", tick: 1, sampleTimeNs: this.nowNs, frames, generations: new Uint8Array() });
  }
}
