import { afterEach, describe, expect, it, vi } from "vitest";
import { HairnetError } from "../../src/hair/hairnetError";
import { Link, webSocketUrl } from "../../src/net/link";
import { FakeSocket } from "../support/fakeSocket";
import { LinkCoreDriver, addCharacter } from "../support/linkCoreDriver";
import { serverPacket } from "../support/serverPacket";

const welcome = serverPacket(1, new LinkCoreDriver().welcome());

function connected(): { connection: Link; sockets: FakeSocket[]; answer: Promise<unknown> } {
  const sockets: FakeSocket[] = [];
  const connection = new Link("localhost:7420", {
    makeSocket: () => {
      sockets.push(new FakeSocket());
      return sockets[sockets.length - 1];
    },
    nowNs: () => Date.now() * 1e6,
    random: () => 0.5,
  });
  const answer = connection.connect();
  return { connection, sockets, answer };
}

describe("connection", () => {
  afterEach(() => void vi.useRealTimers());

  it("finds the WebSocket of a host, a page and itself", () => {
    expect(webSocketUrl("myhost:7420")).toBe("ws://myhost:7420/ws");
    expect(webSocketUrl("http://localhost:7420/room.html?x=1")).toBe("ws://localhost:7420/ws");
    expect(webSocketUrl("https://a.b/")).toBe("wss://a.b/ws");
    expect(webSocketUrl("ws://[::1]:7420/other")).toBe("ws://[::1]:7420/other");
    expect(() => webSocketUrl("ftp://a")).toThrow(HairnetError);
    expect(() => webSocketUrl("http://")).toThrow(HairnetError);
  });

  it("is welcomed, sends what it is asked to, and says goodbye", async () => {
    const { connection, sockets, answer } = connected();
    const [socket] = sockets;
    expect(socket.binaryType).toBe("arraybuffer");
    socket.open();
    socket.tell(welcome);
    await expect(answer).resolves.toMatchObject({ type: "welcome", session: 77n });
    connection.send(addCharacter(1, "00".repeat(32)));
    await Promise.resolve();
    expect(socket.saidTypes).toEqual(["hello", "addCharacter"]);
    connection.close();
    expect(socket.saidTypes.at(-1)).toBe("goodbye");
    expect(socket.closed).toBe(true);
    expect(connection.poll().map((event) => event.type)).toEqual(["connected", "disconnected"]);
  });

  it("goes where a server sends it, by the same kind of address, and only where an address leads", () => {
    vi.useFakeTimers();
    const urls: string[] = [];
    const sockets: FakeSocket[] = [];
    const makeSocket = (url: string): FakeSocket => {
      urls.push(url);
      sockets.push(new FakeSocket());
      return sockets[sockets.length - 1];
    };
    const connection = new Link("wss://hair-1:7420/hair/ws", { makeSocket, nowNs: () => Date.now() * 1e6 });
    void connection.connect();
    for (const host of ["hair-2", "2001:db8::1", "no:address"]) {
      sockets[sockets.length - 1].open();
      sockets[sockets.length - 1].tell(serverPacket(1, { type: "redirect", to: { host, port: 7421 } }));
    }
    expect(urls).toEqual([
      "wss://hair-1:7420/hair/ws",
      "wss://hair-2:7421/hair/ws",
      "wss://[2001:db8::1]:7421/hair/ws",
    ]);
    vi.advanceTimersByTime(1000);
    expect(urls.at(-1)).toBe("wss://hair-1:7420/hair/ws");
    const [first, ...others] = sockets.slice(0, 3).map((socket) => socket.said[0]);
    expect(first).toMatchObject({ type: "hello", trace: expect.toSatisfy((trace: bigint) => trace !== 0n) });
    for (const other of others) expect(other).toMatchObject({ trace: (first as { trace: bigint }).trace });
  });

  it("says in one line why it could not connect", async () => {
    const { sockets, answer } = connected();
    sockets[0].onclose?.({ code: 1006, reason: "" });
    await expect(answer).rejects.toThrow(/no server answers at ws:\/\/localhost:7420\/ws/);
  });

  it("takes no more packets than the socket takes, and goes on when it does", () => {
    vi.useFakeTimers();
    const { connection, sockets } = connected();
    const [socket] = sockets;
    socket.open();
    socket.tell(welcome);
    socket.bufferedAmount = 1 << 20;
    connection.core.send(addCharacter(1, "00".repeat(32)));
    connection.flush();
    expect(socket.saidTypes).toEqual(["hello"]);
    socket.bufferedAmount = 0;
    vi.advanceTimersByTime(20);
    expect(socket.saidTypes).toEqual(["hello", "addCharacter"]);
  });

  it("comes back by itself after the connection broke", () => {
    vi.useFakeTimers();
    const { connection, sockets } = connected();
    sockets[0].open();
    sockets[0].tell(welcome);
    sockets[0].onclose?.({ code: 1006, reason: "" });
    expect(sockets.length).toBe(1);
    vi.advanceTimersByTime(200);
    expect(sockets.length).toBe(2);
    sockets[1].open();
    sockets[1].tell(serverPacket(2, new LinkCoreDriver().welcome({ resumed: true })));
    expect(connection.poll().map((event) => event.type)).toEqual(["connected", "reconnecting", "connected"]);
    // Messages of the old socket are ignored.
    sockets[0].tell(welcome);
    expect(connection.core.isActive).toBe(true);
  });

  it("ends with a server that sends text", async () => {
    const { connection, sockets, answer } = connected();
    sockets[0].open();
    sockets[0].onmessage?.({ data: "hello" });
    expect(connection.core.hasEnded).toBe(true);
    expect(sockets[0].closed).toBe(true);
    await expect(answer).rejects.toThrow(HairnetError);
  });

  it("keeps alive a connection that nobody uses", () => {
    vi.useFakeTimers();
    const { sockets } = connected();
    sockets[0].open();
    sockets[0].tell(welcome);
    vi.advanceTimersByTime(6_000);
    expect(sockets[0].saidTypes).toEqual(["hello", "poseBatch", "poseBatch"]);
  });
});
