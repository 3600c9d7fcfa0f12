import { expect, test } from "vitest";
import { connect, LevelIndex, rigidPose, Role, type RoomOptions, type WebSocketLike } from "../src/index";
import { Link } from "../src/net/link";
import { Room } from "../src/room/room";
import { FakeSocket } from "./support/fakeSocket";
import { strandsFile } from "./support/grooms";
import { openSocket } from "./support/person";
import { Server } from "./support/server";
import { until } from "./support/until";

// Measures what characters cost a browser beside drawing: `npm run bench`. A session with a real server is recorded and
// then played back on a clock of the bench. Times are those of one thread, in us for each character. They are medians,
// because other programs disturb single measurements.

const kCounts = [1, 32, 500];
const kPictureNs = 1e9 / 90;
/** The playback runs so long with everyone's hair before times count, in ns; then kMeasuredNs count. */
const kWarmNs = 2e9;
const kMeasuredNs = 4e9;
/**
 * Poses are pushed twice in each tick of the server, which runs at 10 Hz. A server ends a session that sends more
 * messages a second than its limit allows.
 */
const kPoseMs = 50;

/** What an observer was sent, and when. */
interface Recording {
  readonly packets: { readonly atNs: number; readonly bytes: Uint8Array }[];
  /** Every character has its hair from this time on. */
  readonly wholeFromNs: number;
}

const kOptions: RoomOptions = { makeSocket: (url) => openSocket(url) as unknown as WebSocketLike };
const nowNs = () => Math.round(1e6 * performance.now());

async function record(count: number): Promise<Recording> {
  // At 10 ticks a second a server with two processors has the time to step all 500 characters.
  const server = new Server(["--tick-rate", "10", "--tick-budget", "0.95"]);
  await server.start();
  const owner = await connect(server.address, kOptions);
  const troubles: string[] = [];
  owner.on("state", ({ state, detail }) => {
    if (state !== "connected") troubles.push(detail);
  });
  const hair = await strandsFile(40, 12);
  const characters = Array.from({ length: count }, () => owner.addCharacter(hair, { level: LevelIndex.low }));
  const heads = setInterval(() => {
    for (const [i, character] of characters.entries()) {
      const turn = 0.3 * Math.sin(nowNs() / 15e7 + i);
      character.push(rigidPose([0, Math.sin(turn), 0, Math.cos(turn)], [i, 1.6, 0]));
    }
    owner.sample(0);
  }, kPoseMs);

  const packets: Recording["packets"] = [];
  const observer = await connect(server.address, {
    role: Role.observer,
    makeSocket: (url) => {
      const socket = openSocket(url);
      socket.on("message", (bytes: ArrayBuffer) => packets.push({ atNs: nowNs(), bytes: new Uint8Array(bytes) }));
      return socket as unknown as WebSocketLike;
    },
  });
  const isWhole = () => {
    const members = observer.sample(0);
    return members.length === count && members.every(({ groom, lattice }) => groom && lattice);
  };
  await until("everyone has hair", isWhole);
  const wholeFromNs = nowNs();
  await until("enough is recorded", () => {
    observer.sample(0);
    return nowNs() > wholeFromNs + kWarmNs + kMeasuredNs;
  });
  clearInterval(heads);
  expect(troubles).toEqual([]);
  owner.close();
  observer.close();
  await server.dispose();
  return { packets, wholeFromNs };
}

const median = (times: number[]) => times.sort((a, b) => a - b)[Math.floor(times.length / 2)];

async function play({ packets, wholeFromNs }: Recording, count: number) {
  let clockNs = packets[0].atNs - 1e6;
  const socket = new FakeSocket();
  const link = new Link("localhost", { role: Role.observer, makeSocket: () => socket, nowNs: () => clockNs }, 0.001);
  const room = new Room(link);
  const connected = link.connect();
  socket.open();
  /** Times in us: one for each received frame, and one for each member in each picture. */
  const frames: number[] = [];
  const pictures: number[] = [];
  const timed = (times: number[], work: () => number) => {
    const begun = performance.now();
    const parts = work();
    const us = 1000 * (performance.now() - begun);
    if (clockNs > wholeFromNs + kWarmNs && parts > 0) times.push(us / parts);
  };
  // A measurement counts only if every picture has shown all characters.
  let fewestShown = count;
  const show = () => {
    const shown = room.sample(clockNs / 1e6).length;
    if (clockNs > wholeFromNs + kWarmNs) fewestShown = Math.min(fewestShown, shown);
    return shown;
  };
  let pictureNs = clockNs;
  for (const { atNs, bytes } of packets) {
    for (; pictureNs < atNs; pictureNs += kPictureNs) {
      clockNs = pictureNs;
      timed(pictures, show);
    }
    clockNs = atNs;
    // The copy is made outside of the measured time.
    const data = bytes.slice().buffer;
    const before = room.counters.framesReceived;
    timed(frames, () => {
      socket.onmessage?.({ data });
      return room.counters.framesReceived - before;
    });
  }
  await connected;
  expect(room.counters.framesUndecodable).toBe(0);
  expect(fewestShown).toBe(count);
  expect([...room.members.values()].every(({ lattice }) => lattice)).toBe(true);
  room.close();
  return { frames: median(frames), pictures: median(pictures) };
}

test("a crowd", async () => {
  const rows: object[] = [];
  for (const characters of kCounts) {
    const { frames, pictures } = await play(await record(characters), characters);
    rows.push({ characters, "a frame": frames.toFixed(2), "a picture": pictures.toFixed(2) });
  }
  // biome-ignore lint/suspicious/noConsole: what a benchmark is for
  console.table(rows);
});
