import { checkOptions } from "../hair/checkOptions";
import { HairnetError, type ErrorCode } from "../hair/hairnetError";
import { explainFailure, hostAndPort } from "./connectionFailure";
import type { LinkEvent } from "./events";
import { FallbackSocket, type TransportChoice, type TransportMemory } from "./fallbackSocket";
import { isFinal } from "./finalGoodbye";
import { LinkCore } from "./linkCore";
import { kDefaultOptions, type LinkCounters, type LinkCoreOptions } from "./linkCoreOptions";
import type { ClientMessage, ServerAt, Welcome } from "./messages";

// Bytes that may wait in the socket before no more packets are taken: poses wait in the queue, which can drop old ones.
const kBufferedBytesMax = 64 << 10;
const kBufferedWaitMs = 10;
// Timers' own limit is 2^31 ms.
const kTimerMsMax = 3_600_000;

/** How packets travel. */
export type Transport = "webtransport" | "websocket";

/** What a `Link` needs of a WebSocket: browsers' own, or another's for tests and Node. */
export interface WebSocketLike {
  binaryType: string;
  readonly bufferedAmount: number;
  onopen: ((event: never) => unknown) | null;
  onmessage: ((event: { readonly data: unknown }) => unknown) | null;
  onerror: ((event: never) => unknown) | null;
  onclose: ((event: { readonly code: number; readonly reason: string }) => unknown) | null;
  send(bytes: Uint8Array): void;
  close(): void;
  /** absent: a WebSocket */
  readonly transport?: Transport;
  /** why it is not WebTransport, which was tried before, in one line; null or absent: it is, or that was not tried */
  readonly fallbackReason?: string | null;
  /** Sends a packet that may get lost or overtake others. False: it was not taken; absent: there are no datagrams. */
  sendDatagram?(bytes: Uint8Array): boolean;
  /** Told of an open socket that is better than this open one; who is told uses or closes it. Absent: there never is. */
  onbetter?: ((socket: WebSocketLike) => unknown) | null;
}

export interface LinkOptions extends Partial<LinkCoreOptions> {
  /** "auto" by default: WebTransport where browser, server and network have it, else a WebSocket */
  readonly transport?: TransportChoice;
  /** makes sockets; by default the platform's WebTransport, or its WebSocket with the subprotocol "hairnet" */
  readonly makeSocket?: (url: string) => WebSocketLike;
  /** this client's monotonic clock, ns; by default performance.now() */
  readonly nowNs?: () => number;
}

/** The WebSocket address of a server: of "host:port", of a page's http(s) address, or of ws(s) itself; path /ws. */
export function webSocketUrl(server: string): string {
  let url: URL;
  try {
    if (typeof server !== "string" || server === "") throw new TypeError("no text");
    url = new URL(/^[a-z]+:\/\//i.test(server) ? server : `ws://${server}`);
  } catch {
    throw new HairnetError("invalid", `"${String(server)}" is no address of a server, like "ws://localhost:7420"`);
  }
  const schemes: Record<string, string> = { "http:": "ws:", "https:": "wss:", "ws:": "ws:", "wss:": "wss:" };
  const scheme = schemes[url.protocol];
  if (!scheme) throw new HairnetError("invalid", `"${server}" begins with neither ws(s):// nor http(s)://`);
  const path = url.protocol.startsWith("ws") && url.pathname !== "/" ? url.pathname : "/ws";
  return `${scheme}//${url.host}${path}`;
}

/** The same address of another server. Throws `TypeError` for a host that is none. */
function urlAt(home: string, to: ServerAt | null): string {
  if (!to) return home;
  const { protocol, pathname } = new URL(home);
  return new URL(`${protocol}//${to.host.includes(":") ? `[${to.host}]` : to.host}:${to.port}${pathname}`).href;
}

/**
 * A client's conversation with a server over WebTransport or a WebSocket: a `LinkCore` (see there for what its calls do, by `core`), and
 * what drives it. It connects, comes back after a lost connection, and says what happened as events, which the caller
 * takes with `poll()`, once a picture for example. Nothing here throws but `HairnetError`, for arguments.
 */
export class Link {
  readonly core: LinkCore;
  readonly #url: string;
  readonly #makeSocket: (url: string) => WebSocketLike;
  readonly #isPlatforms: boolean;
  readonly #mayReconnect: boolean;
  readonly #memory: TransportMemory = { blockedUntilNs: -Infinity, reason: null };
  readonly #now: () => number;
  #socket: WebSocketLike | null = null;
  #isOpen = false;
  #timer: ReturnType<typeof setTimeout> | null = null;
  #turnIsDue = false;
  #answer: { resolve: (welcome: Welcome) => void; reject: (error: Error) => void } | null = null;
  #connectCalled = false;
  #failure: ErrorCode = "unreachable";

  constructor(server: string, options: LinkOptions = {}) {
    checkLinkOptions(options, kLinkOptions);
    const { makeSocket, nowNs, transport = "auto", ...linkOptions } = options;
    this.#url = webSocketUrl(server);
    this.#makeSocket = makeSocket ?? ((url) => makePlatformSocket(url, transport, this.#memory, this.#now));
    this.#isPlatforms = !makeSocket;
    this.#mayReconnect = linkOptions.reconnect ?? true;
    this.#now = nowNs ?? monotonicNs;
    this.core = new LinkCore({ trace: drawTrace(), ...linkOptions });
  }

  /** This connection's monotonic clock, ns: that of poses' capture times. */
  nowNs(): number {
    return this.#now();
  }

  /** Once only. Rejects with `HairnetError` when the first attempt fails; what happens later comes as events. */
  connect(): Promise<Welcome> {
    if (this.#connectCalled) return Promise.reject(new HairnetError("invalid", "connect() was called before"));
    this.#connectCalled = true;
    return new Promise((resolve, reject) => {
      this.#answer = { resolve, reject };
      this.core.start();
      this.#turn();
    });
  }

  /** What happened since the last call. A caller that never polls loses the oldest frames, not memory. */
  poll(): LinkEvent[] {
    this.#turn();
    return this.core.takeEvents();
  }

  /** Sends what was asked for since, at once; otherwise it goes with the next poll(), or within a moment. */
  flush(): void {
    this.#turn();
  }

  /** Sends a request, soon: `send({ type: "removeCharacter", character: 1 })`. See `LinkCore.send`. */
  send(message: ClientMessage): void {
    this.use((core) => core.send(message));
  }

  /** Calls of the caller, and a turn soon after: `use((core) => core.requestGroom(...))`. */
  use<T>(call: (core: LinkCore) => T): T {
    const result = call(this.core);
    if (!this.#turnIsDue) {
      this.#turnIsDue = true;
      queueMicrotask(() => {
        this.#turnIsDue = false;
        this.#turn();
      });
    }
    return result;
  }

  get counters(): LinkCounters {
    return this.core.counters;
  }

  /** How the open connection's packets travel; null: none is open. */
  get transport(): Transport | null {
    return this.#isOpen ? (this.#socket?.transport ?? "websocket") : null;
  }

  /** Why packets do not travel by WebTransport, which was tried before, in one line; null: they do, or it was not tried. */
  get fallbackReason(): string | null {
    return this.#isOpen ? (this.#socket?.fallbackReason ?? null) : null;
  }

  /** Says goodbye. */
  close(): void {
    this.core.leave(this.#now());
    this.#turn();
  }

  #turn(): void {
    const { core } = this;
    core.poll(this.#now());
    this.#send();
    if (core.wantsClose) this.#drop();
    if (core.wantsConnection) this.#open();
    this.#tellAnswer();
    this.#setTimer();
  }

  #send(): void {
    const socket = this.#socket;
    while (socket && this.#isOpen && socket.bufferedAmount < kBufferedBytesMax) {
      const packet = this.core.takePacket(this.#now());
      if (!packet) return;
      if (!this.core.takenMayBeLost || !socket.sendDatagram?.(packet)) socket.send(packet);
    }
  }

  #drop(): void {
    const socket = this.#socket;
    this.#forget();
    socket?.close();
    this.core.onClosed("", this.#now());
  }

  #open(): void {
    const to = this.core.redirectedTo;
    this.core.onOpening(this.#now(), to ? `${to.host}, port ${to.port}` : hostAndPort(this.#url));
    let url = to ? `${to.host}, port ${to.port}` : this.#url;
    let socket: WebSocketLike;
    try {
      url = urlAt(this.#url, to);
      socket = this.#makeSocket(url);
    } catch (error) {
      this.core.onClosed(`no socket for ${url}: ${String(error)}`, this.#now());
      return;
    }
    this.#listenTo(socket, url);
    socket.onopen = () => this.#onOpen();
    if (this.#mayReconnect) socket.onbetter = (better) => this.#moveTo(better, url);
  }

  #onOpen(): void {
    this.#isOpen = true;
    this.core.onOpen(this.transport === "webtransport");
    this.#turn();
  }

  /** Goes on over a socket that is open, if the session can. */
  #moveTo(socket: WebSocketLike, url: string): void {
    if (!this.core.replaceConnection("WebTransport is to be had now", this.#now())) return socket.close();
    this.#drop();
    this.core.onOpening(this.#now(), hostAndPort(url));
    this.#listenTo(socket, url);
    this.#onOpen();
  }

  #listenTo(socket: WebSocketLike, url: string): void {
    this.#socket = socket;
    socket.binaryType = "arraybuffer";
    socket.onmessage = ({ data }) => {
      if (data instanceof ArrayBuffer) this.core.onPacket(new Uint8Array(data), this.#now());
      else this.#end("the server sent text");
      this.#turn();
    };
    // Browsers, and Node's ws, say after an error that the socket is closed. Node's own WebSocket does not when it could
    // not be opened.
    socket.onerror = () => {
      if (!this.#isOpen) setTimeout(() => socket.onclose?.({ code: 1006, reason: "" }));
    };
    socket.onclose = ({ code, reason }) => {
      socket.onclose = null;
      // The first attempt's failure is for people; later ones are temporary.
      if (!this.#isOpen && !this.core.welcome && this.#isPlatforms && !this.core.redirectedTo)
        return this.#explain(socket);
      const why = reason || (code === 1006 || code === 1005 ? "" : `code ${code}`);
      const what = this.#isOpen ? "the connection broke" : `no server answers at ${url}`;
      this.#end(why ? `${what}: ${why}` : what);
      this.#turn();
    };
  }

  /** Ends the attempt when the reason for its failure is known. */
  #explain(socket: WebSocketLike): void {
    void explainFailure(this.#url).then(({ code, detail }) => {
      if (this.#socket !== socket) return;
      this.#failure = code;
      this.#end(detail);
      this.#turn();
    });
  }

  /** The connection is over, by the server or the line. */
  #end(detail: string): void {
    const socket = this.#socket;
    if (!socket) return;
    this.#forget();
    socket.close();
    this.core.onClosed(detail, this.#now());
  }

  #forget(): void {
    const socket = this.#socket;
    if (socket) socket.onopen = socket.onmessage = socket.onclose = socket.onbetter = null;
    this.#socket = null;
    this.#isOpen = false;
  }

  #tellAnswer(): void {
    if (!this.#answer) return;
    const { welcome, hasEnded, endReason, endDetail } = this.core;
    if (welcome) this.#answer.resolve(welcome);
    else if (hasEnded) this.#answer.reject(new HairnetError(isFinal(endReason) ? "refused" : this.#failure, endDetail));
    else return;
    this.#answer = null;
  }

  #setTimer(): void {
    if (this.#timer !== null) clearTimeout(this.#timer);
    this.#timer = null;
    if (this.core.hasEnded) return;
    const isFull = this.#socket !== null && this.#isOpen && this.#socket.bufferedAmount >= kBufferedBytesMax;
    const deadlineMs = (this.core.nextDeadlineNs - this.#now()) / 1e6;
    const waitMs = isFull ? Math.min(kBufferedWaitMs, deadlineMs) : deadlineMs;
    if (waitMs === Infinity) return;
    this.#timer = setTimeout(() => this.#turn(), Math.ceil(Math.min(Math.max(waitMs, 0), kTimerMsMax)));
  }
}

const kTransportChoices: readonly string[] = ["auto", "webtransport", "websocket"] satisfies TransportChoice[];

/** @internal The defaults. */
export const kLinkOptions: Readonly<Record<keyof LinkOptions, unknown>> = {
  ...kDefaultOptions,
  transport: "auto",
  makeSocket: makeWebSocket,
  nowNs: monotonicNs,
};

/** @internal Throws `HairnetError` unless each option is in `known`, with the type of its default. */
export function checkLinkOptions<T extends object>(options: T, known: Readonly<Record<keyof T, unknown>>): void {
  checkOptions(options, known, "connect");
  for (const [name, value] of Object.entries(options)) {
    const wanted = typeof known[name as keyof T];
    if (value !== undefined && typeof value !== wanted)
      throw new HairnetError("invalid", `connect: the option '${name}' is a ${wanted}, not ${String(value)}`);
    if (name === "transport" && value !== undefined && !kTransportChoices.includes(String(value)))
      throw new HairnetError("invalid", `connect: the option 'transport' is one of ${kTransportChoices.join(", ")}`);
  }
}

/** No secret: it only tells clients apart in logs. */
function drawTrace(): bigint {
  const word = (): bigint => BigInt(Math.floor(Math.random() * 2 ** 32));
  return word() * 0x1_0000_0000n + word();
}

function makePlatformSocket(
  url: string,
  choice: TransportChoice,
  memory: TransportMemory,
  nowNs: () => number,
): WebSocketLike {
  const hasWebTransport = typeof WebTransport !== "undefined";
  if (choice === "webtransport" && !hasWebTransport)
    throw new HairnetError("unsupported", "this platform, or a page that is not secure, has no WebTransport");
  if (choice === "websocket" || !hasWebTransport) return makeWebSocket(url);
  return new FallbackSocket(url, choice === "auto" ? makeWebSocket : null, memory, nowNs);
}

function makeWebSocket(url: string): WebSocketLike {
  if (typeof WebSocket === "undefined")
    throw new HairnetError("unsupported", "this platform has no WebSocket; give makeSocket");
  return new WebSocket(url, "hairnet") as WebSocketLike;
}

function monotonicNs(): number {
  return Math.round(1e6 * performance.now());
}
