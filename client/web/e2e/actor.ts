import { execFileSync } from "node:child_process";
import { mkdtempSync, readFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import WebSocket from "ws";
import { poseOf, rotationOf } from "../page/head/headPose";
import { connect, type CharacterOptions, type OwnCharacter, type Room, type WebSocketLike } from "../src/index";
import { program } from "./hairnetServer";

/** A pose is sent this often, some 67 times a second: a page is to send 60 to 90 (README.md). */
const kEveryMs = 15;

/** Makes a groom file with hairnet-groom; few strands, for a browser that draws in software. */
export function makeGroomFile(style: string, strands = 300): { path: string; bytes: Uint8Array } {
  const path = join(mkdtempSync(join(tmpdir(), "hairnet-groom-")), `${style}.groom`);
  execFileSync(program("hairnet-groom"), ["make", style, "--strands", String(strands), "--out", path]);
  return { path, bytes: new Uint8Array(readFileSync(path)) };
}

/** A participant of a room, in the test's process, whose head turns on the test's command. */
export class Actor {
  /** The direction of the head about +Y, rad. The next pose has it. */
  yawRad = 0;
  readonly #timer: ReturnType<typeof setInterval>;

  private constructor(
    readonly room: Room,
    readonly own: OwnCharacter,
    at: readonly [number, number, number],
  ) {
    this.#timer = setInterval(() => {
      room.sample(performance.now());
      own.push(poseOf(rotationOf({ yawRad: this.yawRad, pitchRad: 0, rollRad: 0 }), at, 0));
    }, kEveryMs);
  }

  static async join(
    server: string,
    room: string,
    groom: Uint8Array,
    at: readonly [number, number, number] = [0, 0, 0],
    options: CharacterOptions = {},
  ): Promise<Actor> {
    const joined = await connect(server, {
      room,
      clientName: "e2e actor",
      makeSocket: (url) => {
        const socket = new WebSocket(url, "hairnet");
        // The close event, which follows every error, is handled elsewhere.
        socket.on("error", () => {});
        return socket as unknown as WebSocketLike;
      },
    });
    joined.on("error", ({ detail }) => console.log(`the server reports: ${detail}`));
    return new Actor(joined, joined.addCharacter(groom, options), at);
  }

  /** Turns evenly, within `durationS`. */
  async turnTo(yawRad: number, durationS: number): Promise<void> {
    const from = this.yawRad;
    const start = performance.now();
    for (let t = 0; t < 1; ) {
      t = Math.min((performance.now() - start) / 1000 / durationS, 1);
      this.yawRad = from + t * (yawRad - from);
      await new Promise((done) => setTimeout(done, kEveryMs));
    }
  }

  leave(): void {
    clearInterval(this.#timer);
    this.room.close();
  }
}
