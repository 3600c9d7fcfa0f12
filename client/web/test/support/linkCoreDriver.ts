import { LevelIndex } from "../../src/hair/level";
import type { LinkEvent } from "../../src/net/events";
import type { LinkCoreOptions } from "../../src/net/linkCoreOptions";
import { LinkCore } from "../../src/net/linkCore";
import {
  kProtocolVersion,
  type AddCharacter,
  type Message,
  type ServerMessage,
  type Welcome,
} from "../../src/net/messages";
import { decodePacket } from "../../src/net/packet";
import { serverPacket } from "./serverPacket";

export const kSecond = 1e9;

/** No tag and no appearance. */
export const kPlain = { tag: new Uint8Array(), appearance: null } as const;

export function addCharacter(character: number, groom: string, level = LevelIndex.high): AddCharacter {
  return { type: "addCharacter", character, groom, level, state: null, ...kPlain };
}

/** A core, its connections, and a server that sends what the test wants. The test owns the time. */
export class LinkCoreDriver {
  readonly core: LinkCore;
  nowNs = 1000 * kSecond;
  /** lead of the server's clock over ours */
  serverAheadNs = 5 * kSecond;

  constructor(options: Partial<LinkCoreOptions> = {}) {
    this.core = new LinkCore({ random: () => 0.5, ...options });
    this.core.start();
  }

  welcome(more: Partial<Welcome> = {}): Welcome {
    return {
      type: "welcome",
      protocolVersion: kProtocolVersion,
      session: 77n,
      tickRateHz: 30,
      tick: 0,
      characterCountMax: 10,
      groomBytesMax: 1e6,
      room: "",
      secret: Uint8Array.from({ length: 16 }, (_, i) => (i === 0 ? 9 : 0)),
      resumed: false,
      resumeGraceS: 30,
      poseDelayNs: 0,
      maySetWind: true,
      signsOfLife: false,
      others: [],
      ...more,
    };
  }

  /** Opens the requested connection; returns the hello. */
  open(hasDatagrams = false): Message {
    this.core.poll(this.nowNs);
    if (!this.core.wantsConnection) throw new Error("no connection is wanted");
    this.core.onOpening(this.nowNs);
    this.core.onOpen(hasDatagrams);
    return this.sent()[0];
  }

  /** Also welcomes it; returns its immediate messages. */
  join(more: Partial<Welcome> = {}): Message[] {
    this.open();
    this.tell(this.welcome(more));
    return this.sent();
  }

  /** After the connection broke: waits until the core requests another. */
  rejoin(more: Partial<Welcome> = {}): Message[] {
    this.pass(6 * kSecond);
    return this.join(more);
  }

  tell(message: ServerMessage): void {
    this.core.onPacket(serverPacket(this.nowNs + this.serverAheadNs, message), this.nowNs);
  }

  /** The core's messages now. */
  sent(): Message[] {
    const messages: Message[] = [];
    for (let packet = this.core.takePacket(this.nowNs); packet; packet = this.core.takePacket(this.nowNs))
      messages.push(decodePacket(packet).message);
    return messages;
  }

  pass(ns: number): void {
    this.nowNs += ns;
    this.core.poll(this.nowNs);
  }

  break(detail = "the line is dead"): void {
    this.core.onClosed(detail, this.nowNs);
  }

  events(): LinkEvent[] {
    return this.core.takeEvents();
  }
  eventTypes(): string[] {
    return this.events().map((event) => event.type);
  }
}
