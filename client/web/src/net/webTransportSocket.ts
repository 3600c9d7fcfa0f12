import { kDatagramBytesMax } from "../generated/constants";
import { HairnetError } from "../module/hairnetError";
import type { WebSocketLike } from "./socket";
import { PacketSplitter } from "./packetSplitter";

// The browser keeps at most this many datagrams until they are read. A tick brings one for every few people, all at
// once, and the browsers' own limit would lose some of them.
const kIncomingDatagramsMax = 1024;
// With this many datagrams waiting to be sent, further ones are dropped: they hold poses, and later poses replace them.
const kOutgoingDatagramsMax = 16;
/** A SHA-256 has this length. */
const kHashBytes = 32;
/** `close` waits this long for packets that were sent before. */
const kGoodbyeMs = 1000;

/** What `GET /wt.json` of a server says. */
export interface WebTransportPage {
  readonly port: number;
  readonly path: string;
  /** SHA-256 of the certificates that it may show; none: they are signed by an authority that browsers trust */
  readonly hashes: readonly Uint8Array[];
}

/**
 * The stream that takes datagrams to send. `createWritable()` is the later standard and Safari's only way; other
 * browsers have `writable`.
 */
function outgoingDatagrams(session: WebTransport): WritableStream<Uint8Array> {
  const datagrams: { createWritable?: () => WritableStream<Uint8Array>; writable: WritableStream<Uint8Array> } =
    session.datagrams;
  return datagrams.createWritable?.() ?? datagrams.writable;
}

/** The address of a server's /wt.json, by its WebSocket address. */
export function webTransportPageUrl(webSocketUrl: string): string {
  const { protocol, host } = new URL(webSocketUrl);
  return `${protocol === "wss:" ? "https" : "http"}://${host}/wt.json`;
}

/** Reads the text of /wt.json. Null: the server has no WebTransport. Throws `HairnetError` for a damaged text. */
export function readWebTransportPage(text: string): WebTransportPage | null {
  try {
    const { port, path, hashes } = JSON.parse(text);
    if (port === 0) return null;
    const isValid = Number.isInteger(port) && port > 0 && port < 65_536;
    if (!isValid || typeof path !== "string" || !path.startsWith("/") || !Array.isArray(hashes))
      throw new TypeError("a value is missing, or out of range");
    const bytes = hashes.map((hash) => Uint8Array.from(atob(hash), (letter) => letter.charCodeAt(0)));
    if (bytes.some((hash) => hash.length !== kHashBytes)) throw new TypeError("a hash has another length");
    return { port, path, hashes: bytes };
  } catch (error) {
    throw new HairnetError("malformed", `the server's page about WebTransport is damaged: ${String(error)}`);
  }
}

/** The address to connect to. Servers of the loopback listen on IPv4, which "localhost" may not mean. */
export function webTransportUrl(webSocketUrl: string, page: WebTransportPage): string {
  const { hostname } = new URL(webSocketUrl);
  return `https://${hostname === "localhost" ? "127.0.0.1" : hostname}:${page.port}${page.path}`;
}

type CloseListener = (event: { readonly code: number; readonly reason: string }) => unknown;

/**
 * A WebTransport session that looks like a WebSocket: packets in order travel on one stream, each after its size,
 * packets that may be lost in datagrams, and those of each download on a stream of its own. `open()` makes it; it is
 * then open.
 */
export class WebTransportSocket implements WebSocketLike {
  readonly transport = "webtransport";
  binaryType = "arraybuffer";
  onopen: ((event: never) => unknown) | null = null;
  onmessage: ((event: { readonly data: unknown }) => unknown) | null = null;
  onerror: ((event: never) => unknown) | null = null;
  #onclose: CloseListener | null = null;
  /** Why the session has ended; null: it goes on. */
  #endReason: string | null = null;
  /** The bytes that `send` has given to the stream and that have not left yet. */
  #bufferedAmount = 0;
  /** How many datagrams have not left yet; see kOutgoingDatagramsMax. */
  #datagramsWaiting = 0;
  /** This side has closed it, by `close`. */
  #isClosed = false;
  readonly #session: WebTransport;
  readonly #stream: WritableStreamDefaultWriter<Uint8Array>;
  readonly #datagrams: WritableStreamDefaultWriter<Uint8Array>;

  private constructor(session: WebTransport, channel: WebTransportBidirectionalStream) {
    this.#session = session;
    this.#stream = channel.writable.getWriter();
    this.#datagrams = outgoingDatagrams(session).getWriter();
    session.datagrams.incomingHighWaterMark = kIncomingDatagramsMax;
    void session.closed.then(
      ({ reason }) => this.#end(reason ?? ""),
      (error) => this.#end(String(error)),
    );
    void this.#readChannel(channel.readable);
    void this.#readDownloads(session.incomingUnidirectionalStreams);
    void this.#readDatagrams(session.datagrams.readable);
  }

  /** Rejects when no session opens; `signal` ends the attempt. */
  static async open(webSocketUrl: string, page: WebTransportPage, signal: AbortSignal): Promise<WebTransportSocket> {
    const serverCertificateHashes = page.hashes.map((value) => ({
      algorithm: "sha-256",
      value: value as BufferSource,
    }));
    const session = new WebTransport(webTransportUrl(webSocketUrl, page), {
      ...(serverCertificateHashes.length > 0 ? { serverCertificateHashes } : {}),
      congestionControl: "low-latency",
    });
    session.closed.catch(() => {});
    const stop = () => session.close();
    signal.addEventListener("abort", stop);
    try {
      await session.ready;
      const channel = await session.createBidirectionalStream();
      signal.throwIfAborted();
      return new WebTransportSocket(session, channel);
    } catch (error) {
      stop();
      throw error;
    } finally {
      signal.removeEventListener("abort", stop);
    }
  }

  get bufferedAmount(): number {
    return this.#bufferedAmount;
  }

  /** The listener hears also of an end that came before it was set. */
  set onclose(tell: CloseListener | null) {
    this.#onclose = tell;
    const reason = this.#endReason;
    if (tell && reason !== null) queueMicrotask(() => tell({ code: 1006, reason }));
  }
  get onclose(): CloseListener | null {
    return this.#onclose;
  }

  send(bytes: Uint8Array): void {
    this.#bufferedAmount += bytes.length;
    const done = () => (this.#bufferedAmount -= bytes.length);
    this.#stream.write(bytes).then(done, done);
  }

  sendDatagram(bytes: Uint8Array): boolean {
    const { maxDatagramSize } = this.#session.datagrams;
    if (bytes.length > Math.min(kDatagramBytesMax, maxDatagramSize)) return false;
    // A datagram may get lost anywhere: the sender must not send this one again over the stream.
    if (this.#datagramsWaiting >= kOutgoingDatagramsMax) return true;
    ++this.#datagramsWaiting;
    const done = () => --this.#datagramsWaiting;
    this.#datagrams.write(bytes).then(done, done);
    return true;
  }

  /** Ends the session after what was sent before has left, or after kGoodbyeMs. */
  close(): void {
    if (this.#isClosed) return;
    this.#isClosed = true;
    const end = () => {
      try {
        this.#session.close();
      } catch {
        // The server has closed the session already.
      }
    };
    const timer = setTimeout(end, kGoodbyeMs);
    const endNow = () => {
      clearTimeout(timer);
      end();
    };
    this.#stream.close().then(endNow, endNow);
  }

  /** Reads the stream of packets in order; its end is the end of the session. */
  async #readChannel(readable: ReadableStream<Uint8Array>): Promise<void> {
    try {
      await this.#readPackets(readable);
      this.#end("");
    } catch (error) {
      this.#end(String(error));
    }
  }

  /** Reads the streams that the server opens, one for each download, all at the same time. */
  async #readDownloads(streams: ReadableStream<ReadableStream<Uint8Array>>): Promise<void> {
    const reader = streams.getReader();
    try {
      for (let next = await reader.read(); !next.done; next = await reader.read()) void this.#readDownload(next.value);
    } catch {
      // The session has ended, which `closed` tells.
    }
  }

  async #readDownload(readable: ReadableStream<Uint8Array>): Promise<void> {
    try {
      if (!(await this.#readPackets(readable))) this.#fail("the server ended a download within a packet");
    } catch {
      // The server has given up the download, and says so on the stream of packets in order.
    }
  }

  /** Passes on the packets of a stream until it ends. Returns false if it ended within a packet. */
  async #readPackets(readable: ReadableStream<Uint8Array>): Promise<boolean> {
    const splitter = new PacketSplitter();
    const reader = readable.getReader();
    for (let read = await reader.read(); !read.done; read = await reader.read()) {
      const isValid = splitter.feed(read.value, (packet) => this.onmessage?.({ data: packet.buffer }));
      if (isValid) continue;
      this.#fail("the server sent a size that no packet has");
      break;
    }
    return splitter.isBetweenPackets;
  }

  async #readDatagrams(readable: ReadableStream<Uint8Array>): Promise<void> {
    const reader = readable.getReader();
    try {
      for (let read = await reader.read(); !read.done; read = await reader.read()) {
        this.onmessage?.({ data: read.value.slice().buffer });
      }
    } catch {
      // The session has ended, which `closed` tells.
    }
  }

  /** The server has broken the protocol: ends the session. */
  #fail(reason: string): void {
    this.#end(reason);
    this.close();
  }

  /** Tells the listener once that the session has ended. 1006 is browsers' code of a connection that broke. */
  #end(reason: string): void {
    if (this.#endReason !== null) return;
    this.#endReason = reason;
    const tell = this.#onclose;
    this.#onclose = this.onmessage = null;
    tell?.({ code: 1006, reason });
  }
}
