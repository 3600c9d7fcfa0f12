import WebSocket from "ws";
import { connect, rigidPose, type Member, type OwnCharacter, type Room, type RoomOptions } from "../../src/index";
import type { WebSocketLike } from "../../src/index";
import { until } from "./until";

/** A person takes a picture and sends a pose this often: 100 times a second, a little more often than most headsets. */
const kEveryMs = 10;

/** A WebSocket of Node's `ws`. */
export function openSocket(url: string): WebSocket {
  const socket = new WebSocket(url, "hairnet");
  // The close event, which follows every error, is handled elsewhere.
  socket.on("error", () => {});
  return socket;
}

/**
 * Someone in a room, who does what a page does: samples the room again and again, and pushes poses of a head that turns
 * while there is an own character. Call `leave` at the end of a test.
 */
export class Person {
  /** The room's newest connection. */
  socket!: WebSocket;
  /** A test sets what `room.addCharacter` returns; the person then pushes its poses. */
  own: OwnCharacter | null = null;
  /** Whether the character's head turns. A head that rests sends poses, but its hair comes to rest. */
  moves = true;
  /** The events of the room, one line each. */
  readonly heard: string[] = [];
  readonly #turns = setInterval(() => this.#turn(), kEveryMs);

  private constructor(readonly room: Room) {
    const { heard } = this;
    room.on("state", ({ state, detail }) => heard.push(detail ? `${state}: ${detail}` : state));
    room.on("joined", ({ member }) => heard.push(`joined ${member.tagText}`));
    room.on("changed", ({ member }) => heard.push(`changed ${member.tagText}`));
    room.on("left", ({ member }) => heard.push(`left ${member.tagText}`));
    room.on("error", ({ detail }) => heard.push(`error: ${detail}`));
  }

  static async join(server: string, options: RoomOptions = {}): Promise<Person> {
    let newest: WebSocket | undefined;
    let person: Person | undefined;
    // The first socket is made before there is a Person, later ones when the room reconnects.
    const makeSocket = (url: string): WebSocketLike => {
      newest = openSocket(url);
      if (person) person.socket = newest;
      return newest as unknown as WebSocketLike;
    };
    person = new Person(await connect(server, { makeSocket, ...options }));
    if (newest) person.socket = newest;
    return person;
  }

  /** The member with that tag. */
  named(name: string): Member | undefined {
    return [...this.room.members.values()].find((member) => member.tagText === name);
  }

  /** Waits for the member with that tag. */
  async meets(name: string): Promise<Member> {
    await until(`${name} is met`, () => this.named(name) !== undefined);
    return this.named(name)!;
  }

  leave(): void {
    clearInterval(this.#turns);
    this.room.close();
  }

  #turn(): void {
    const nowMs = performance.now();
    this.room.sample(nowMs);
    // Half the angle of the head, rad: it turns by 0.6 rad to both sides about once a second, so that its hair swings.
    const turn = this.moves ? 0.3 * Math.sin(nowMs / 150) : 0;
    this.own?.push(rigidPose([0, Math.sin(turn), 0, Math.cos(turn)], [0, 1.6, 0]));
  }
}
