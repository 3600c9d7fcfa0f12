import { once } from "node:events";
import type { AddressInfo } from "node:net";
import { afterAll, afterEach, beforeAll, describe, expect, it } from "vitest";
import { WebSocketServer, type WebSocket } from "ws";
import { connect, rigidPose, type RoomOptions, type WebSocketLike } from "../../src/index";
import { FakeSocket } from "../support/fakeSocket";
import { strandsFile } from "../support/grooms";
import { openSocket, Person } from "../support/person";
import { Server } from "../support/server";
import { until } from "../support/until";

const like = (socket: WebSocket) => socket as unknown as WebSocketLike;
const refusalOf = (server: string, options: RoomOptions) =>
  connect(server, options).then(
    () => "none",
    ({ code, message }: { code: string; message: string }) => `${code}: ${message}`,
  );

describe("a first attempt fails in one line", () => {
  it("where no socket is available, or it does not open", async () => {
    const broken = (): WebSocketLike => {
      const socket = new FakeSocket();
      queueMicrotask(() => socket.break());
      return socket;
    };
    const none = (): never => {
      throw new Error("not today");
    };
    expect(await refusalOf("localhost:1", { makeSocket: broken })).toBe(
      "unreachable: no server answers at ws://localhost:1/ws",
    );
    expect(await refusalOf("localhost:1", { makeSocket: none })).toBe(
      "unreachable: no socket for ws://localhost:1/ws: Error: not today",
    );
  });

  it("at a server that says nothing, text, or no packet of Hairnet", async () => {
    const peer = new WebSocketServer({ port: 0, host: "127.0.0.1" });
    await once(peer, "listening");
    const { port } = peer.address() as AddressInfo;
    // The default is 5 s (kClientDefaults), which would make the silent server's part long.
    const options: RoomOptions = { makeSocket: (url) => like(openSocket(url)), connectTimeoutS: 0.3 };
    const answers: [string | Uint8Array | null, RegExp][] = [
      [null, /^unreachable: no welcome from the server within the time-out$/],
      ["hello", /^unreachable: the server sent text$/],
      [new Uint8Array(40), /^refused: the server sent a bad packet: [^\n]+$/],
    ];
    for (const [answer, expected] of answers) {
      peer.once("connection", (socket) => socket.on("message", () => answer !== null && socket.send(answer)));
      expect(await refusalOf(`127.0.0.1:${port}`, options)).toMatch(expected);
    }
    await until("no connection is left open", () => peer.clients.size === 0);
    peer.close();
  });
});

describe("with a server", () => {
  const server = new Server();
  const people: Person[] = [];
  const join = async (options: RoomOptions = {}) => {
    const person = await Person.join(server.address, options);
    people.push(person);
    return person;
  };
  beforeAll(() => server.start());
  afterEach(() => {
    for (const person of people.splice(0)) person.leave();
  });
  afterAll(() => server.dispose());

  it("takes no more packets than the socket takes, and goes on when it does", async () => {
    let buffered = 0;
    const person = await join({
      makeSocket: (url) => Object.defineProperty(like(openSocket(url)), "bufferedAmount", { get: () => buffered }),
    });
    // The link writes while fewer than 64 kB wait in the socket (kBufferedBytesMax of link.ts); here 1 MB waits.
    buffered = 1 << 20;
    const { bytesSent } = person.room.counters;
    person.own = person.room.addCharacter(await strandsFile(20, 6), { tag: "Ann" });
    // Without the limit this turn would send the new character.
    person.room.link.turn();
    expect(person.room.counters.bytesSent).toBe(bytesSent);
    buffered = 0;
    await person.meets("Ann");
  });

  // The session must go on over the new socket: with a new session everyone would see the person leave and join again.
  it("moves to a socket that is better, and the session goes on", async () => {
    const sockets: WebSocket[] = [];
    const makeSocket = (url: string): WebSocketLike => {
      sockets.push(openSocket(url));
      return like(sockets[sockets.length - 1]);
    };
    const person = await join({ makeSocket });
    const { session } = person.room;
    const first = like(sockets[0]);
    const better = openSocket(sockets[0].url);
    await once(better, "open");
    // A socket announces a better one, as FallbackSocket does when WebTransport becomes available.
    first.onbetter!(like(better));
    expect(first.onmessage).toBeNull();
    await until("it has resumed", () => person.room.counters.resumes === 1);
    await until("it is told", () => person.heard.at(-1) === "connected");
    expect(person.heard).toEqual(["connected", "reconnecting: WebTransport is available now", "connected"]);
    expect(person.room.session).toBe(session);
    expect(sockets).toHaveLength(1);
    await until("the first is closed", () => sockets[0].readyState === sockets[0].CLOSED);

    const staying = await join({ makeSocket, reconnect: false });
    // A room that must not reconnect cannot move either.
    expect(like(sockets[1]).onbetter).toBeUndefined();
    sockets[1].terminate();
    await until("it has ended", () => staying.room.state === "closed");
    expect(staying.heard.at(-1)).toMatch(/^closed: .*the connection broke$/);
  });

  it("says goodbye at once, and forgets everyone", async () => {
    const other = await join();
    const person = await join();
    person.own = person.room.addCharacter(await strandsFile(20, 6), { tag: "Ben" });
    await other.meets("Ben");
    await person.meets("Ben");
    person.leave();
    expect(person.room.state).toBe("closed");
    expect(person.room.members.size).toBe(0);
    expect(person.own.member).toBeNull();
    expect(person.room.sample(0)).toEqual([]);
    // Calls after the end must not throw: a render loop may still be running.
    person.own.push(rigidPose());
    await until("the other sees it leave", () => other.named("Ben") === undefined);
    await until("its socket is closed", () => person.socket.readyState === person.socket.CLOSED);
    expect(person.heard.filter((line) => line.startsWith("closed"))).toEqual(["closed"]);
    expect(person.heard).toContain("left Ben");
  });
});
