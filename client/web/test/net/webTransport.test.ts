import { once } from "node:events";
import { afterEach, beforeEach, describe, expect, it, vi } from "vitest";
import { HairnetError } from "../../src/module/hairnetError";
import {
  readWebTransportPage,
  WebTransportSocket,
  webTransportPageUrl,
  webTransportUrl,
} from "../../src/net/webTransportSocket";
import { connect, rigidPose } from "../../src/index";
import { FakeWebTransport, kWebTransportPage } from "../support/fakeWebTransport";
import { strandsFile } from "../support/grooms";
import { openSocket } from "../support/person";
import { Server } from "../support/server";
import { until } from "../support/until";

/** A packet of `byteCount` bytes: its size without the first four bytes, then `fill`. */
function packet(byteCount: number, fill: number): Uint8Array {
  const made = new Uint8Array(byteCount).fill(fill);
  new DataView(made.buffer).setUint32(0, byteCount - 4, true);
  return made;
}

beforeEach(() => {
  FakeWebTransport.reset();
  vi.stubGlobal("WebTransport", FakeWebTransport);
});
afterEach(() => void vi.unstubAllGlobals());

describe("page about WebTransport", () => {
  it("is beside the WebSocket, and says where to connect", () => {
    expect(webTransportPageUrl("ws://localhost:7420/ws")).toBe("http://localhost:7420/wt.json");
    expect(webTransportPageUrl("wss://a.example/ws")).toBe("https://a.example/wt.json");
    const page = readWebTransportPage(kWebTransportPage)!;
    expect(page.hashes[0]).toEqual(new Uint8Array(32).fill(7));
    expect(webTransportUrl("ws://localhost:7420/ws", page)).toBe("https://127.0.0.1:7421/wt");
    expect(webTransportUrl("wss://[::1]:7420/ws", page)).toBe("https://[::1]:7421/wt");
    expect(readWebTransportPage('{"port":0,"path":"","hashes":[]}')).toBeNull();
  });

  it("is refused when it is damaged", () => {
    // After what is no JSON object come a port above 65535, a path without a slash, no hashes, a hash of 3 bytes, and
    // one that is no base64.
    for (const text of [
      "",
      "null",
      "<html>",
      '{"port":70000,"path":"/wt","hashes":[]}',
      '{"port":7420,"path":"wt","hashes":[]}',
      '{"port":7420,"path":"/wt"}',
      '{"port":7420,"path":"/wt","hashes":["AAAA"]}',
      '{"port":7420,"path":"/wt","hashes":["%"]}',
    ])
      expect(() => readWebTransportPage(text), text).toThrow(HairnetError);
  });
});

describe("socket over WebTransport", () => {
  async function opened() {
    const page = readWebTransportPage(kWebTransportPage)!;
    const socket = await WebTransportSocket.open("ws://localhost:7420/ws", page, new AbortController().signal);
    const [session] = FakeWebTransport.made;
    const heard: Uint8Array[] = [];
    let end: string | null = null;
    socket.onmessage = ({ data }) => heard.push(new Uint8Array(data as ArrayBuffer));
    socket.onclose = ({ reason }) => (end = reason);
    return { socket, session, heard, endReason: () => end };
  }
  /** Tests send this packet last: once it has arrived, so has everything before it. */
  const last = packet(16, 99);

  it("opens where the page says, and shows packets of its channel, in any pieces, and datagrams", async () => {
    const { session, heard } = await opened();
    expect(session.url).toBe("https://127.0.0.1:7421/wt");
    expect(session.options.serverCertificateHashes).toEqual([
      { algorithm: "sha-256", value: new Uint8Array(32).fill(7) },
    ]);
    for (const byte of packet(20, 1)) session.tell(Uint8Array.of(byte));
    await until("it is heard", () => heard.length === 1);
    session.tellDatagram(Uint8Array.of(1, 2, 3));
    await until("the datagram is heard", () => heard.length === 2);
    expect(heard).toEqual([packet(20, 1), Uint8Array.of(1, 2, 3)]);
  });

  it.each(["writable", "createWritable"] as const)("sends in order, or as datagrams, by %s", async (way) => {
    FakeWebTransport.datagramsBy = way;
    const { socket, session } = await opened();
    socket.send(packet(5000, 1));
    expect(socket.bufferedAmount).toBe(5000);
    expect(socket.sendDatagram(packet(900, 2))).toBe(true);
    // A datagram has at most 1024 bytes (kDatagramBytesMax), although the session would take 1200. A larger packet must
    // go over the stream.
    expect(socket.sendDatagram(packet(1100, 3))).toBe(false);
    await until("both have left", () => session.sent.length === 1 && session.datagramsSent.length === 1);
    expect([session.sent[0], session.datagramsSent[0]]).toEqual([packet(5000, 1), packet(900, 2)]);
    await until("nothing waits", () => socket.bufferedAmount === 0);
    socket.send(last);
    socket.close();
    await until("its last packet has left", () => session.isClosed);
    expect(session.sent.at(-1)).toEqual(last);
    expect(session.streamEnded).toBe(true);
  });

  it("hears downloads that hold up neither others nor the channel, and outlives those that the server gives up", async () => {
    const { session, heard, endReason } = await opened();
    const stalled = session.openStream();
    // A download stops in the middle of a packet. Its rest comes after everything else has been heard.
    stalled.enqueue(packet(1000, 1).subarray(0, 700));
    session.openStream().enqueue(packet(500, 2));
    await until("the other is heard", () => heard.length === 1);
    session.tell(packet(16, 3));
    await until("the channel is heard", () => heard.length === 2);
    stalled.enqueue(packet(1000, 1).subarray(700));
    await until("the rest is heard", () => heard.length === 3);
    stalled.enqueue(packet(1000, 4).subarray(0, 700));
    stalled.error(new Error("reset"));
    session.tell(last);
    await until("the last is heard", () => heard.length === 4);
    expect(heard).toEqual([packet(500, 2), packet(16, 3), packet(1000, 1), last]);
    expect(endReason()).toBeNull();
  });

  it.each(["a size that no packet has", "the end within a packet"])("ends at a download with %s", async (what) => {
    const { session, endReason } = await opened();
    const stream = session.openStream();
    if (what.startsWith("a size")) {
      // The first four bytes announce a size of 0, which no packet has.
      stream.enqueue(new Uint8Array(20));
    } else {
      stream.enqueue(packet(1000, 1).subarray(0, 500));
      stream.close();
    }
    await until("it has ended", () => session.isClosed);
    expect(endReason()).toMatch(/^the server (sent|ended) a /);
  });

  // The session may end before `onclose` is set. A user who never heard of the end would never reconnect.
  it("tells of the session's end, also to who listens later", async () => {
    const { socket, session, endReason } = await opened();
    session.end("the server stops");
    await until("it is told", () => endReason() === "the server stops");
    const again = await new Promise((resolve) => (socket.onclose = resolve));
    expect(again).toEqual({ code: 1006, reason: "the server stops" });
  });
});

// A lost pose is replaced by the next one, so poses may travel in datagrams. A teleport that got lost would leave hair
// that swings after the jump, so it must arrive (`OwnCharacter.push`).
it("a room over WebTransport sends poses as datagrams, and jumps and all else in order", async () => {
  const server = new Server();
  await server.start();
  vi.stubGlobal("fetch", () => Promise.resolve({ ok: true, text: () => Promise.resolve(kWebTransportPage) }));
  FakeWebTransport.relay = openSocket(`ws://127.0.0.1:${server.port}/ws`);
  await once(FakeWebTransport.relay, "open");
  const room = await connect(server.address);
  const [session] = FakeWebTransport.made;
  expect([room.link.transport, room.link.fallbackReason]).toEqual(["webtransport", null]);
  const me = room.addCharacter(await strandsFile(20, 6));
  await until("it is here", () => {
    room.sample(0);
    return me.member !== null;
  });
  expect(session.datagramsSent).toEqual([]);
  const inOrder = session.sent.length;
  me.push(rigidPose());
  await until("the pose has left", () => session.datagramsSent.length > 0);
  expect(session.sent).toHaveLength(inOrder);
  me.push(rigidPose([0, 0, 0, 1], [0, 1, 0]), true);
  await until("the jump has left", () => session.sent.length > inOrder);
  room.close();
  await until("its goodbye has left", () => session.isClosed);
  await server.dispose();
});
