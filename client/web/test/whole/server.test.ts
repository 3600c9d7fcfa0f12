import { readFileSync } from "node:fs";
import { join } from "node:path";
import { afterAll, beforeAll, describe, expect, it } from "vitest";
import WebSocket from "ws";
import { Link, LevelIndex, Playout, decodeGroom, rigidPose } from "../../src/index";
import type { Frame, FrameBatch, GroomFetched, LinkEvent, MemberJoined, WebSocketLike } from "../../src/index";
import { kObserveAll } from "../../src/net/roomMessages";
import { addCharacter } from "../support/linkCoreDriver";
import { Server, findServer } from "../support/server";
import { until } from "../support/until";
import { vectorFolder } from "../support/vectors";

interface Received {
  readonly frame: Frame;
  readonly sampleTimeNs: number;
  readonly arrivalNs: number;
}

const moves = ({ frame }: Received) => frame.coefficients.some((each) => Math.abs(each) > 0.001);

/** One client with a record of its events. */
class Client {
  readonly events: LinkEvent[] = [];
  readonly frames: Received[] = [];
  readonly link: Link;
  socket: WebSocket | null = null;
  readonly #turns: ReturnType<typeof setInterval>;
  #sequence = 0;
  #isStreaming = false;

  constructor(port: number, name: string, room: string) {
    this.link = new Link(`127.0.0.1:${port}`, {
      clientName: name,
      room,
      makeSocket: (url) => {
        this.socket = new WebSocket(url, "hairnet");
        return this.socket as unknown as WebSocketLike;
      },
    });
    this.#turns = setInterval(() => this.#turn(), 10);
  }

  stream(): void {
    this.#isStreaming = true;
  }

  of<T extends LinkEvent["type"]>(type: T): Extract<LinkEvent, { type: T }>[] {
    return this.events.filter((event): event is Extract<LinkEvent, { type: T }> => event.type === type);
  }

  stop(): void {
    clearInterval(this.#turns);
    this.link.close();
  }

  #turn(): void {
    const now = this.link.nowNs();
    if (this.#isStreaming) {
      const turn = 0.5 * Math.sin(6e-9 * now);
      const pose = rigidPose([0, Math.sin(turn / 2), 0, Math.cos(turn / 2)], [0.1 * Math.sin(4e-9 * now), 1.6, 0]);
      this.link.core.pushPoses([
        { character: 1, sequence: ++this.#sequence, captureTimeNs: now, teleport: false, pose },
      ]);
    }
    for (const event of this.link.poll()) {
      if (event.type === "frameBatch") this.#take(event, now);
      else this.events.push(event);
    }
  }

  #take(batch: FrameBatch, now: number): void {
    const sampleTimeNs = this.link.core.toLocalNs(batch.sampleTimeNs);
    for (const frame of batch.frames) this.frames.push({ frame, sampleTimeNs, arrivalNs: now });
  }
}

// deploy/test builds the server before; a package that is tested alone has none.
const program = findServer();
describe.skipIf(program === null)("with a server", () => {
  const server = new Server(program!);
  const file = readFileSync(join(vectorFolder, "bob.groom"));
  const clients: Client[] = [];
  const join_ = async (name: string, room = "web"): Promise<Client> => {
    const client = new Client(server.port, name, room);
    clients.push(client);
    await client.link.connect();
    return client;
  };

  beforeAll(() => server.start());
  afterAll(async () => {
    for (const client of clients) client.stop();
    await server.dispose();
  });

  it("hair that one client brings moves on another's screen, through a broken line and a server's death", async () => {
    const owner = await join_("owner");
    const hash = owner.link.core.offerGroom(file);
    owner.link.core.send(addCharacter(1, hash, LevelIndex.low));
    owner.stream();
    const observer = await join_("observer");

    await until("the member is announced", () => observer.of("memberJoined").length > 0);
    const joined: MemberJoined = observer.of("memberJoined")[0];
    expect(joined).toMatchObject({ character: 1, groom: hash });

    await until("hair comes", () => observer.frames.some((each) => each.frame.basis));
    observer.link.use((core) => core.requestGroom(hash));
    await until("the groom comes", () => observer.of("groomFetched").length > 0);
    const fetched: GroomFetched = observer.of("groomFetched")[0];
    expect(Buffer.compare(fetched.bytes!, file)).toBe(0);
    expect(decodeGroom(fetched.bytes!).strands.count).toBe(120);

    await until("hair moves", () => observer.frames.filter(moves).length > 40);
    expect(observer.link.counters).toMatchObject({ framesUndecodable: 0 });
    playOut(observer);

    // The connection breaks: the session continues.
    owner.socket!.terminate();
    await until("the owner comes back", () => owner.of("connected").length === 2);
    expect(owner.link.counters).toMatchObject({ reconnects: 1, resumes: 1 });
    expect(observer.of("memberLeft")).toEqual([]);

    // The server dies: a new one gets everything again, and the hair continues.
    await server.kill();
    await server.start();
    await until("both come back", () => owner.of("connected").length === 3 && observer.of("connected").length === 2);
    const before = owner.frames.length;
    const isSimulated = ({ frame }: Received) => frame.basis !== null && !frame.lastKnown;
    await until("the new server sends hair", () => owner.frames.slice(before).some(isSimulated));
    // It continued from its last state: hair was not at rest. A server that needs more than two seconds for its levels
    // sends it rigid until then.
    expect(moves(owner.frames.slice(before).find(isSimulated)!)).toBe(true);
    await until("the member is announced again", () => observer.of("memberJoined").length === 2);
    expect(observer.of("memberLeft").length).toBe(1);
    expect(owner.of("error")).toEqual([]);
    expect(observer.of("error")).toEqual([]);
  });

  it("hair keeps its basis on every level and over a broken line", async () => {
    const client = await join_("wearer", "basis");
    const { core } = client.link;
    const hash = core.offerGroom(file);
    core.send(addCharacter(1, hash, LevelIndex.high));
    core.send({ ...kObserveAll, errorM: 0.0005 });
    client.stream();
    await until("hair moves", () => client.frames.filter(moves).length > 30);
    const { basis } = client.frames.find(moves)!.frame;
    expect(basis!.geometry.lattice.dims).toEqual([10, 10, 10]);

    core.send({ type: "setLevel", character: 1, level: LevelIndex.low });
    await until("the level is low", () => client.frames.at(-1)!.frame.level === LevelIndex.low);
    const before = client.frames.length;
    await until("the low level moves it, too", () => client.frames.slice(before).filter(moves).length > 30);
    for (const { frame } of client.frames.slice(before)) expect(frame.basis).toBe(basis);

    client.socket!.terminate();
    await until("it comes back", () => client.of("connected").length === 2);
    const after = client.frames.length;
    await until("hair moves again", () => client.frames.slice(after).filter(moves).length > 30);
    // The basis that was here is used again.
    expect(client.frames.at(-1)!.frame.basis).toBe(basis);
    expect(client.link.counters).toMatchObject({ framesUndecodable: 0 });
    expect(client.of("error")).toEqual([]);
  });

  /** The frames can be shown at any moment: finite, and without jumps. */
  function playOut(observer: Client): void {
    const playout = new Playout();
    const frames = observer.frames.slice();
    let last: Float64Array | null = null;
    let next = 0;
    for (let now = frames[0].arrivalNs; now < frames[frames.length - 1].arrivalNs; now += 11e6) {
      for (; next < frames.length && frames[next].arrivalNs <= now; ++next)
        playout.push(frames[next].frame, frames[next].sampleTimeNs, frames[next].arrivalNs);
      const sample = playout.sample(now)!;
      expect(sample.coefficients.every(Number.isFinite)).toBe(true);
      expect(sample.pose.every(Number.isFinite)).toBe(true);
      // The head moves by less than 0.4 m/s.
      if (last) expect(Math.abs(sample.pose[4] - last[4])).toBeLessThan(0.05);
      last = sample.pose.slice();
    }
  }
});
