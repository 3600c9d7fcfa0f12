import { afterEach, beforeEach, expect, it, vi } from "vitest";
import { FallbackSocket, type TransportMemory } from "../../src/net/fallbackSocket";
import type { WebSocketLike } from "../../src/net/socket";
import { connect, HairnetError } from "../../src/index";
import { FakeSocket } from "../support/fakeSocket";
import { FakeWebTransport, kWebTransportPage } from "../support/fakeWebTransport";

const sockets: FakeSocket[] = [];
let page = kWebTransportPage;
let memory: TransportMemory;

function makeWebSocket(): FakeSocket {
  sockets.push(new FakeSocket());
  return sockets[sockets.length - 1];
}

/** Makes a FallbackSocket and collects what it reports. `alone`: WebTransport without a fallback. */
function opened({ alone = false } = {}) {
  const socket = new FallbackSocket("ws://localhost:7420/ws", alone ? null : makeWebSocket, memory, () =>
    Math.round(1e6 * performance.now()),
  );
  const heard = { opens: 0, closed: [] as string[], better: [] as WebSocketLike[] };
  socket.onopen = () => ++heard.opens;
  socket.onclose = ({ reason }) => heard.closed.push(reason);
  socket.onbetter = (better) => heard.better.push(better);
  return { socket, heard };
}
const pass = (ms: number) => vi.advanceTimersByTimeAsync(ms);

// Time is simulated: `pass` advances it. WebTransport gets 3 s to open (kWebTransportMs), and after a failure it is not
// tried for a minute (kBlockedMs of fallbackSocket.ts).
beforeEach(() => {
  vi.useFakeTimers();
  sockets.length = 0;
  page = kWebTransportPage;
  memory = { blockedUntilNs: -Infinity, reason: null };
  FakeWebTransport.reset();
  vi.stubGlobal("WebTransport", FakeWebTransport);
  vi.stubGlobal("fetch", () => Promise.resolve({ ok: page !== "", text: () => Promise.resolve(page) }));
});
afterEach(() => {
  vi.useRealTimers();
  vi.unstubAllGlobals();
});

it("is a session where one opens", async () => {
  const { socket, heard } = opened();
  await pass(10);
  expect([heard.opens, socket.transport, socket.fallbackReason]).toEqual([1, "webtransport", null]);
  expect(sockets).toEqual([]);
  socket.close();
  await pass(2000);
  expect(FakeWebTransport.made[0].isClosed).toBe(true);
});

it("is a WebSocket where sessions fail, says why, and tries none for a minute", async () => {
  FakeWebTransport.fate = "fail";
  const { socket, heard } = opened();
  await pass(10);
  sockets[0].open();
  expect([heard.opens, socket.transport, socket.fallbackReason]).toEqual([1, "websocket", "refused"]);
  expect(FakeWebTransport.made[0].isClosed).toBe(true);
  socket.send(Uint8Array.of(1));
  expect(sockets[0].sent).toEqual([Uint8Array.of(1)]);
  expect(socket.sendDatagram(Uint8Array.of(2))).toBe(false);
  sockets[0].break("gone");
  expect(heard.closed).toEqual(["gone"]);
  socket.close();

  const second = opened();
  await pass(10);
  // The second socket has tried no session within the minute.
  expect(FakeWebTransport.made).toHaveLength(1);
  expect([second.socket.transport, second.socket.fallbackReason]).toEqual(["websocket", "refused"]);
  second.socket.close();
  FakeWebTransport.fate = "open";
  await pass(60_000);
  const third = opened();
  await pass(10);
  expect(third.socket.transport).toBe("webtransport");
  third.socket.close();
});

// A network may start to let UDP through, for example when a laptop changes its Wi-Fi. Without another attempt the page
// would stay on the slower transport until it is loaded again.
it("hands over a session that opens after all, a minute or more later", async () => {
  FakeWebTransport.fate = "fail";
  const { socket, heard } = opened();
  await pass(10);
  sockets[0].open();
  await pass(60_100);
  expect(FakeWebTransport.made).toHaveLength(2);
  expect(heard.better).toEqual([]);
  FakeWebTransport.fate = "open";
  await pass(60_100);
  expect(heard.better.map(({ transport }) => transport)).toEqual(["webtransport"]);
  // The listener of `onbetter` moves the session over (`Link`). Until then the WebSocket must stay open.
  expect(sockets[0].closed).toBe(false);
  socket.close();
  expect(sockets[0].closed).toBe(true);
});

it("tries no more where nobody wants a better one, or once it is closed, and drops a session that opens late", async () => {
  FakeWebTransport.fate = "fail";
  const unwanted = opened();
  unwanted.socket.onbetter = null;
  await pass(10);
  await pass(120_000);
  expect(FakeWebTransport.made).toHaveLength(1);
  unwanted.socket.close();

  memory.blockedUntilNs = -Infinity;
  const { socket, heard } = opened();
  await pass(10);
  FakeWebTransport.fate = "silence";
  // A minute after the failure the next attempt begins, and is still silent when the socket is closed.
  await pass(61_000);
  expect(FakeWebTransport.made).toHaveLength(3);
  socket.close();
  await pass(120_000);
  expect(FakeWebTransport.made).toHaveLength(3);
  expect(FakeWebTransport.made[2].isClosed).toBe(true);
  expect(heard.better).toEqual([]);
});

it("falls back within 3 s where nothing answers, and at once where the server has none", async () => {
  FakeWebTransport.fate = "silence";
  const { socket } = opened();
  // Just before the 3 s are over (kWebTransportMs) no WebSocket is made yet, and just after them there is one.
  await pass(2900);
  expect([FakeWebTransport.made.length, sockets.length]).toEqual([1, 0]);
  await pass(200);
  expect(sockets).toHaveLength(1);
  expect(socket.fallbackReason).toBe("no session opened within 3 s");
  socket.close();
  memory.blockedUntilNs = -Infinity;
  for (const [answer, reason] of [
    ['{"port":0,"path":"","hashes":[]}', "the server has none"],
    ["", "the server does not know it"],
  ]) {
    page = answer;
    const none = opened();
    await pass(10);
    expect(none.socket.fallbackReason).toBe(reason);
    none.socket.close();
  }
  expect(FakeWebTransport.made).toHaveLength(1);
});

it("does without a WebSocket when asked for WebTransport alone, and the other way round", async () => {
  FakeWebTransport.fate = "fail";
  const { heard } = opened({ alone: true });
  await pass(10);
  expect(heard.closed).toEqual(["no WebTransport: refused"]);
  expect(sockets).toEqual([]);
  vi.useRealTimers();
  const refused = connect("localhost:7420", { transport: "webtransport", reconnect: false });
  await expect(refused).rejects.toThrow(HairnetError);
  await expect(connect("localhost:7420", { transport: "pigeon" as never })).rejects.toThrow(/one of auto/);
  vi.stubGlobal("WebSocket", makeWebSocket);
  const made = FakeWebTransport.made.length;
  const other = connect("localhost:7420", { transport: "websocket" }).catch((error: unknown) => error);
  await vi.waitUntil(() => sockets.length === 1);
  sockets[0].break();
  expect(await other).toBeInstanceOf(HairnetError);
  expect(FakeWebTransport.made).toHaveLength(made);
});
