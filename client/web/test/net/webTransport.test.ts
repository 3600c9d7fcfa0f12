import { afterEach, beforeEach, describe, expect, it, vi } from "vitest";
import { rigidPose } from "../../src/hair/pose";
import { HairnetError } from "../../src/hair/hairnetError";
import { hashGroom } from "../../src/net/groomHash";
import { Link } from "../../src/net/link";
import { ErrorReason, GroomState } from "../../src/net/messages";
import { decodePacket } from "../../src/net/packet";
import { readWebTransportPage, webTransportPageUrl, webTransportUrl } from "../../src/net/webTransportSocket";
import { FakeSocket } from "../support/fakeSocket";
import { FakeWebTransport } from "../support/fakeWebTransport";
import { addCharacter, LinkCoreDriver } from "../support/linkCoreDriver";
import { serverPacket } from "../support/serverPacket";
import { fromHex } from "../support/vectors";
import { until } from "../support/until";

const kHash = btoa(String.fromCharCode(...Array(32).fill(7)));
const kPage = JSON.stringify({ port: 7421, path: "/wt", hashes: [kHash] });
/** That of schema/PROTOCOL.md, of a member that is not known. */
const kFrameDatagram = fromHex("4642c0e552b10000000040787d01002a05ac022202aabb");
const welcome = serverPacket(1, new LinkCoreDriver().welcome());

describe("page about WebTransport", () => {
  it("is beside the WebSocket, and says where to connect", () => {
    expect(webTransportPageUrl("ws://localhost:7420/ws")).toBe("http://localhost:7420/wt.json");
    expect(webTransportPageUrl("wss://a.example/ws")).toBe("https://a.example/wt.json");
    const page = readWebTransportPage(kPage)!;
    expect(page.hashes[0]).toEqual(new Uint8Array(32).fill(7));
    expect(webTransportUrl("ws://localhost:7420/ws", page)).toBe("https://127.0.0.1:7421/wt");
    expect(webTransportUrl("wss://[::1]:7420/ws", page)).toBe("https://[::1]:7421/wt");
    expect(readWebTransportPage('{"port":0,"path":"","hashes":[]}')).toBeNull();
  });

  it("is refused when it is damaged", () => {
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

describe("link over WebTransport", () => {
  const sockets: FakeSocket[] = [];
  let page: string | null = kPage;
  beforeEach(() => {
    sockets.length = 0;
    FakeWebTransport.made = [];
    FakeWebTransport.fate = "open";
    FakeWebTransport.datagramsBy = "writable";
    page = kPage;
    vi.stubGlobal("WebTransport", FakeWebTransport);
    vi.stubGlobal(
      "WebSocket",
      class extends FakeSocket {
        constructor() {
          super();
          sockets.push(this);
        }
      },
    );
    vi.stubGlobal("fetch", async () => ({ ok: page !== null, text: async () => page ?? "" }));
  });
  afterEach(() => {
    vi.useRealTimers();
    vi.unstubAllGlobals();
  });

  async function connected(): Promise<[Link, FakeWebTransport]> {
    const link = new Link("localhost:7420");
    const answer = link.connect();
    await until("it says hello", () => FakeWebTransport.made[0]?.sent.length > 0);
    const [session] = FakeWebTransport.made;
    session.tell(welcome);
    await answer;
    return [link, session];
  }
  const types = (packets: readonly Uint8Array[]) => packets.map((packet) => decodePacket(packet).message.type);

  it("is welcomed on the stream, whose packets come in any pieces", async () => {
    const link = new Link("localhost:7420");
    const answer = link.connect();
    await until("it says hello", () => FakeWebTransport.made[0]?.sent.length > 0);
    const [session] = FakeWebTransport.made;
    expect(session.url).toBe("https://127.0.0.1:7421/wt");
    expect(session.options.serverCertificateHashes).toEqual([
      { algorithm: "sha-256", value: new Uint8Array(32).fill(7) },
    ]);
    for (const byte of welcome) session.tell(Uint8Array.of(byte));
    await expect(answer).resolves.toMatchObject({ type: "welcome" });
    expect(link.transport).toBe("webtransport");
    expect(sockets).toEqual([]);
    link.close();
    await until("its goodbye has left", () => session.isClosed);
    expect(types(session.sent)).toEqual(["hello", "goodbye"]);
    expect(session.streamEnded).toBe(true);
  });

  it.each(["writable", "createWritable"] as const)(
    "sends poses as datagrams, but for jumps, signs of life and what is too large, by %s",
    async (way) => {
      FakeWebTransport.datagramsBy = way;
      const [link, session] = await connected();
      const pose = (character: number, teleport: boolean) => ({
        character,
        sequence: 1,
        captureTimeNs: link.nowNs(),
        teleport,
        pose: rigidPose([0, 0, 0, 1]),
      });
      link.send(addCharacter(1, "00".repeat(32)));
      link.use((core) => core.pushPoses([pose(1, false)]));
      link.use((core) => core.pushPoses([pose(1, true)]));
      link.use((core) => core.pushPoses([]));
      link.use((core) => core.pushPoses(Array.from({ length: 33 }, (_, c) => pose(c + 1, false))));
      await until("all have left", () => session.sent.length >= 4);
      expect(types(session.datagramsSent)).toEqual(["poseBatch"]);
      expect(types(session.sent).slice(0, 2)).toEqual(["hello", "addCharacter"]);
      expect(session.datagramsSent[0].length).toBeLessThanOrEqual(1024);
    },
  );

  it("takes packets of datagrams, and ends at one that is none", async () => {
    const [link, session] = await connected();
    session.tellDatagram(serverPacket(2, { type: "memberLeft", member: 9 }));
    session.tellDatagram(kFrameDatagram);
    await until("its frame is counted", () => link.use((core) => core.counters.framesUnknown) === 1);
    expect(session.isClosed).toBe(false);
    session.tellDatagram(new Uint8Array(40));
    await until("it has ended", () => session.isClosed);
    link.close();
  });

  describe("downloads", () => {
    const file = new Uint8Array(3000).map((_, n) => n);
    const other = new Uint8Array(500).map((_, n) => 3 * n);
    const piece = (bytes: Uint8Array, begin: number, end: number) =>
      serverPacket(2, {
        type: "groomData",
        hash: hashGroom(bytes),
        byteCount: bytes.length,
        offset: begin,
        bytes: bytes.subarray(begin, end),
      });
    const events = (link: Link) => link.poll().map((event) => event.type);

    it("hold up neither messages nor each other, and come in any pieces", async () => {
      const [link, session] = await connected();
      for (const bytes of [file, other]) link.use((core) => core.requestGroom(hashGroom(bytes)));
      const stalled = session.openStream();
      const first = piece(file, 0, 1000);
      stalled.enqueue(first.subarray(0, 700)); // and then nothing for a while
      session.openStream().enqueue(piece(other, 0, 500));
      session.tell(serverPacket(3, { type: "groomStatus", hash: "11".repeat(32), state: GroomState.queued }));
      const seen: string[] = [];
      await until("both are here", () => seen.push(...events(link)) >= 3);
      expect(new Set(seen)).toEqual(new Set(["connected", "groomFetched", "groomStatus"]));
      stalled.enqueue(first.subarray(700));
      stalled.enqueue(piece(file, 1000, 3000));
      stalled.close();
      await until("the rest is here", () => events(link).includes("groomFetched"));
      link.close();
    });

    it("that the server gives up leave the link as it is, and can be asked for again", async () => {
      const [link, session] = await connected();
      link.use((core) => core.requestGroom(hashGroom(file)));
      const given = session.openStream();
      given.enqueue(piece(file, 0, 1000));
      given.error(new Error("reset"));
      const error = { type: "error", reason: ErrorReason.groomUnavailable, character: 0, detail: "" } as const;
      session.tell(serverPacket(3, { ...error, groom: hashGroom(file) }));
      await until("it is told", () => events(link).includes("error"));
      link.use((core) => core.requestGroom(hashGroom(file)));
      const again = session.openStream();
      again.enqueue(piece(file, 0, 2000));
      session.openStream().enqueue(piece(file, 0, 1000)); // of the first one, late
      again.enqueue(piece(file, 2000, 3000));
      await until("it is here", () => events(link).includes("groomFetched"));
      expect(session.isClosed).toBe(false);
      link.close();
    });

    it("that nobody has asked for are dropped", async () => {
      const [link, session] = await connected();
      session.openStream().enqueue(piece(file, 0, 3000));
      session.tell(serverPacket(3, { type: "groomStatus", hash: "11".repeat(32), state: GroomState.queued }));
      const seen: string[] = [];
      await until("the status is here", () => seen.push(...events(link)) >= 2);
      expect(seen).toEqual(["connected", "groomStatus"]);
      expect(session.isClosed).toBe(false);
      link.close();
    });

    it.each(["a size that no packet has", "the end within a packet"])("end the session with %s", async (what) => {
      const [link, session] = await connected();
      const stream = session.openStream();
      if (what.startsWith("a size")) {
        stream.enqueue(new Uint8Array(20));
      } else {
        stream.enqueue(piece(file, 0, 1000).subarray(0, 500));
        stream.close();
      }
      await until("it has ended", () => session.isClosed);
      link.close();
    });
  });

  it("comes back after the session has ended", async () => {
    const [link, session] = await connected();
    session.end("the server stops");
    await until("it connects again", () => {
      link.poll();
      return FakeWebTransport.made.length === 2;
    });
    link.close();
  });

  it("falls back to a WebSocket where sessions fail, says why, and tries again after a minute", async () => {
    FakeWebTransport.fate = "fail";
    let aheadNs = 0;
    const link = new Link("localhost:7420", { nowNs: () => aheadNs + Math.round(1e6 * performance.now()) });
    const answer = link.connect();
    await until("a WebSocket is tried", () => sockets.length === 1);
    sockets[0].open();
    sockets[0].tell(welcome);
    await answer;
    expect(link.transport).toBe("websocket");
    expect(link.fallbackReason).toBe("refused");
    expect(FakeWebTransport.made[0].isClosed).toBe(true);
    sockets[0].onclose?.({ code: 1006, reason: "" });
    expect(link.fallbackReason).toBeNull();
    await until("it comes back", () => {
      link.poll();
      return sockets.length === 2;
    });
    expect(FakeWebTransport.made.length).toBe(1);
    sockets[1].open();
    expect(link.fallbackReason).toBe("refused");
    FakeWebTransport.fate = "open";
    aheadNs = 60e9;
    sockets[1].onclose?.({ code: 1006, reason: "" });
    await until("it tries WebTransport again", () => {
      link.poll();
      return link.transport === "webtransport";
    });
    expect(link.fallbackReason).toBeNull();
    expect(sockets.length).toBe(2);
    link.close();
  });

  describe("that had to fall back", () => {
    const events = (link: Link) => link.poll().map((event) => event.type);
    async function fallenBack(options: object): Promise<Link> {
      vi.useFakeTimers();
      FakeWebTransport.fate = "fail";
      const link = new Link("localhost:7420", options);
      const answer = link.connect();
      await vi.advanceTimersByTimeAsync(10);
      sockets[0].open();
      sockets[0].tell(welcome);
      await answer;
      expect(link.transport).toBe("websocket");
      return link;
    }

    it("moves up when sessions open after all, and resumes there", async () => {
      const link = await fallenBack({});
      await vi.advanceTimersByTimeAsync(60_100);
      expect(FakeWebTransport.made.length).toBe(2);
      expect(sockets[0].closed).toBe(false);
      expect(link.counters.reconnects).toBe(0);
      FakeWebTransport.fate = "open";
      expect(events(link)).toEqual(["connected"]);
      await vi.advanceTimersByTimeAsync(60_100);
      const session = FakeWebTransport.made[2];
      expect(sockets[0].closed).toBe(true);
      expect(decodePacket(session.sent[0]).message).toMatchObject({ type: "hello", session: 77n });
      session.tell(serverPacket(2, { ...new LinkCoreDriver().welcome(), resumed: true }));
      await vi.advanceTimersByTimeAsync(10);
      expect(events(link)).toEqual(["reconnecting", "connected"]);
      expect([link.transport, link.fallbackReason]).toEqual(["webtransport", null]);
      expect(link.counters.resumes).toBe(1);
      await vi.advanceTimersByTimeAsync(120_000);
      expect([FakeWebTransport.made.length, sockets.length]).toEqual([3, 1]);
      link.close();
    });

    it("closes a session that it cannot use, and tries again a minute later", async () => {
      const link = await fallenBack({ connectTimeoutS: 100 });
      FakeWebTransport.fate = "open";
      sockets[0].onclose?.({ code: 1006, reason: "" });
      await vi.advanceTimersByTimeAsync(2000);
      expect(sockets.length).toBe(2);
      sockets[1].open(); // and no welcome, for which it waits longer than usual
      await vi.advanceTimersByTimeAsync(58_200);
      expect(FakeWebTransport.made[1].isClosed).toBe(true);
      sockets[1].tell(welcome);
      await vi.advanceTimersByTimeAsync(60_100);
      expect(FakeWebTransport.made[2].sent.length).toBeGreaterThan(0);
      link.close();
    });

    it("stays where it is when it may not reconnect", async () => {
      const link = await fallenBack({ reconnect: false });
      await vi.advanceTimersByTimeAsync(120_000);
      expect(FakeWebTransport.made.length).toBe(1);
      link.close();
    });

    it("tries no more once it is closed, and drops a session that opens late", async () => {
      const link = await fallenBack({});
      FakeWebTransport.fate = "silence";
      await vi.advanceTimersByTimeAsync(61_000);
      expect(FakeWebTransport.made.length).toBe(2);
      link.close();
      await vi.advanceTimersByTimeAsync(120_000);
      expect(FakeWebTransport.made.length).toBe(2);
      expect(FakeWebTransport.made[1].isClosed).toBe(true);
    });
  });

  it("falls back within 3 s where nothing answers", async () => {
    vi.useFakeTimers();
    FakeWebTransport.fate = "silence";
    const link = new Link("localhost:7420", { connectTimeoutS: 10 });
    void link.connect().catch(() => {});
    await vi.advanceTimersByTimeAsync(2900);
    expect(FakeWebTransport.made.length).toBe(1);
    expect(sockets.length).toBe(0);
    await vi.advanceTimersByTimeAsync(200);
    expect(sockets.length).toBe(1);
    sockets[0].open();
    expect(link.fallbackReason).toBe("no session opened within 3 s");
    link.close();
  });

  it("uses a WebSocket at once where the server or the option says so", async () => {
    page = '{"port":0,"path":"","hashes":[]}';
    const link = new Link("localhost:7420");
    void link.connect().catch(() => {});
    await until("a WebSocket is tried", () => sockets.length === 1);
    sockets[0].open();
    expect(link.fallbackReason).toBe("the server has none");
    link.close();
    page = kPage;
    const other = new Link("localhost:7420", { transport: "websocket" });
    void other.connect().catch(() => {});
    expect(sockets.length).toBe(2);
    other.close();
    expect(FakeWebTransport.made).toEqual([]);
  });

  it("does without a WebSocket when asked for WebTransport alone", async () => {
    FakeWebTransport.fate = "fail";
    const link = new Link("localhost:7420", { transport: "webtransport", reconnect: false });
    await expect(link.connect()).rejects.toThrow(HairnetError);
    expect(sockets).toEqual([]);
    expect(() => new Link("localhost:7420", { transport: "pigeon" as never })).toThrow(/one of auto/);
  });
});
