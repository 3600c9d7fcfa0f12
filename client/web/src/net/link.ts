import { HairnetError, type ErrorCode } from "../module/hairnetError";
import { client } from "../module/client";
import type { Instance } from "../module/instance";
import { explainFailure } from "./connectionFailure";
import { FallbackSocket, type TransportMemory } from "./fallbackSocket";
import { kClientDefaults, type LinkOptions, Role } from "./linkOptions";
import type { Transport, WebSocketLike } from "./socket";
import { urlAt, webSocketUrl } from "./url";

// With more bytes than this waiting in the socket no more packets are taken from the room. Poses then wait in the
// room's queue, which can drop old ones.
const kBufferedBytesMax = 64 << 10;
// While the socket is full, the link looks this often whether it has room again: sockets have no event for it.
const kBufferedWaitMs = 10;
// A longer wait is cut into turns of an hour. Browsers' timers can wait for at most 2^31 ms.
const kTimerMsMax = 3_600_000;

/** `hairnet_room_state` of client/hairnet.h. */
export enum LinkState {
  connecting,
  connected,
  reconnecting,
  closed,
}

/** `hairnet_event_kind` of client/hairnet.h. */
export enum EventKind {
  state,
  joined,
  left,
  changed,
  wind,
  error,
  held,
  props,
  touch,
}

/** `hairnet_event` of client/hairnet.h, which explains each. */
export interface LinkEvent {
  readonly kind: EventKind;
  readonly state: LinkState;
  readonly member: number;
  readonly character: number;
  readonly isRefused: boolean;
  readonly hand: number;
  readonly held: number;
  readonly session: bigint;
  readonly waitS: number;
  readonly text: string;
}
// The sizes of hairnet_event and hairnet_options of client/hairnet.h in WebAssembly, where pointers have 4 bytes.
const kEventBytes = 48;
const kOptionsBytes = 72;

/**
 * A room of the C++ client, and the sockets that it asks for: WebTransport or a WebSocket. It connects, comes back
 * after a lost connection, and has events, which the caller takes. Nothing here throws but `HairnetError`, for
 * arguments.
 */
export class Link {
  /** The handle of the hairnet_room. It is freed when nothing refers to this link any more. */
  readonly room: number;
  readonly #module: Instance;
  readonly #url: string;
  readonly #makeSocket: (url: string) => WebSocketLike;
  /** The sockets are the platform's own, and not the caller's: then a request can tell why one failed. */
  readonly #isPlatforms: boolean;
  readonly #mayReconnect: boolean;
  readonly #memory: TransportMemory = { blockedUntilNs: -Infinity, reason: null };
  readonly #now: () => number;
  readonly #events: LinkEvent[] = [];
  /** A buffer in the module's memory for packets that arrive: its address and size. */
  #packet = { at: 0, byteCount: 0 };
  #socket: WebSocketLike | null = null;
  /** The socket has opened. */
  #isOpen = false;
  /** Calls `turn` at the room's next deadline. */
  #timer: ReturnType<typeof setTimeout> | null = null;
  /** `soon` has asked for a turn that has not begun. */
  #turnIsDue = false;
  /** The promise of `connect`; null: it is settled, or `connect` was not called. */
  #answer: { resolve: () => void; reject: (error: Error) => void } | null = null;
  /** The code of the error with which `connect` rejects, unless the server refuses. */
  #failure: ErrorCode = "unreachable";

  /**
   * The client must have started (`startClient`). `errorM`: the error of hair that is wanted where a head fills the
   * screen, m.
   */
  constructor(server: string, options: LinkOptions, errorM: number) {
    const { makeSocket, nowNs, transport = "auto" } = options;
    this.#module = client();
    this.#url = webSocketUrl(server);
    this.#makeSocket = makeSocket ?? ((url) => makePlatformSocket(url, transport, this.#memory, this.#now));
    this.#isPlatforms = !makeSocket;
    this.#mayReconnect = options.reconnect ?? kClientDefaults.reconnect;
    this.#now = nowNs ?? monotonicNs;
    this.room = this.#openRoom(options, errorM);
    this.#module.freeAfter(this, "hairnet_room_free", this.room);
  }

  /** This connection's monotonic clock, ns. */
  nowNs(): number {
    return this.#now();
  }

  /**
   * Joins; call it once. Rejects with `HairnetError` when the first attempt fails; what happens later comes as events.
   */
  connect(): Promise<void> {
    return new Promise((resolve, reject) => {
      this.#answer = { resolve, reject };
      this.turn();
    });
  }

  /** Returns the events up to the last `hairnet_advance` of the room, in order, and forgets them. */
  takeEvents(): LinkEvent[] {
    const module = this.#module;
    for (;;) {
      let isThere = 0;
      const event = module.struct(kEventBytes, (at) => (isThere = module.call("hairnet_next_event", this.room, at)));
      if (isThere === 0) return this.#events.splice(0);
      const text = event.getUint32(40, true);
      this.#events.push({
        kind: event.getUint32(0, true),
        state: event.getUint32(4, true),
        member: event.getUint32(8, true),
        character: event.getUint32(12, true),
        isRefused: event.getUint32(16, true) !== 0,
        hand: event.getUint16(20, true),
        held: event.getUint16(22, true),
        session: event.getBigUint64(24, true),
        waitS: event.getFloat64(32, true),
        text: module.text(text),
      });
    }
  }

  /** Takes one turn after the current task, however often a task calls it. Call it when there is something to send. */
  soon(): void {
    if (this.#turnIsDue) return;
    this.#turnIsDue = true;
    queueMicrotask(() => {
      this.#turnIsDue = false;
      this.turn();
    });
  }

  /** How the open connection's packets travel; null: none is open. */
  get transport(): Transport | null {
    return this.#isOpen ? (this.#socket?.transport ?? "websocket") : null;
  }

  /**
   * Why packets do not travel by WebTransport, which was tried before, in one line; null: they do, or it was not tried.
   */
  get fallbackReason(): string | null {
    return this.#isOpen ? (this.#socket?.fallbackReason ?? null) : null;
  }

  /**
   * Does what the room wants now ("bytes in and out" of client/hairnet.h): lets it work, sends its packets, closes or
   * opens its connection. It also sets the timer for the next turn.
   */
  turn(): void {
    this.#call("hairnet_poll");
    this.#send();
    if (this.#module.call("hairnet_wants_close", this.room)) this.#drop();
    this.#openIfWanted();
    this.#tellAnswer();
    this.#setTimer();
  }

  /** Calls a function whose last argument is the time. */
  #call(name: string, ...values: number[]): number {
    return this.#module.call(name, this.room, ...values, this.#time());
  }
  #time(): bigint {
    return BigInt(Math.round(this.#now()));
  }

  #openRoom(options: LinkOptions, errorM: number): number {
    const module = this.#module;
    const { clientName, room, token, role, connectTimeoutS, reconnect, giveUpAfterS } = {
      ...kClientDefaults,
      ...Object.fromEntries(Object.entries(options).filter(([, value]) => value !== undefined)),
    };
    // The places are those of the fields of hairnet_options; fields that are left out are 0.
    const bytes = new DataView(new ArrayBuffer(kOptionsBytes));
    bytes.setUint32(0, kOptionsBytes, true);
    bytes.setUint32(8, module.name(room), true);
    bytes.setUint32(12, module.name(token), true);
    bytes.setUint32(16, module.name(clientName), true);
    bytes.setUint32(24, Number(role === Role.observer), true);
    bytes.setUint32(32, Number(!reconnect), true);
    bytes.setFloat64(40, connectTimeoutS, true);
    bytes.setFloat64(48, giveUpAfterS, true);
    bytes.setFloat32(56, errorM, true);
    bytes.setBigUint64(64, drawTrace(), true);
    let opened = 0;
    module.with(new Uint8Array(bytes.buffer), (at) =>
      module.struct(4, (result) => {
        module.check("connect: ", "hairnet_open", at, this.#time(), result);
        opened = module.u32(result);
      }),
    );
    return opened;
  }

  #send(): void {
    const module = this.#module;
    const socket = this.#socket;
    while (socket && this.#isOpen && socket.bufferedAmount < kBufferedBytesMax) {
      let at = 0;
      const taken = module.struct(8, (result) => {
        at = module.call("hairnet_take_packet", this.room, this.#time(), result, result + 4);
      });
      if (at === 0) return;
      const mayBeLost = taken.getUint32(4, true) !== 0;
      const packet = module.copy(at, taken.getUint32(0, true));
      if (!mayBeLost || !socket.sendDatagram?.(packet)) socket.send(packet);
    }
  }

  /** Closes the connection because the room wants it closed. */
  #drop(): void {
    const socket = this.#socket;
    this.#forget();
    socket?.close();
    this.#call("hairnet_on_closed", 0);
  }

  #openIfWanted(): void {
    const module = this.#module;
    let wanted = 0;
    const to = module.struct(6, (at) => (wanted = module.call("hairnet_wants_connection", this.room, at, at + 4)));
    if (!wanted) return;
    const [host, port] = [module.text(to.getUint32(0, true)), to.getUint16(4, true)];
    // A room that is on another server of a fleet names it. Otherwise the connection goes to the server of the options.
    const isElsewhere = host !== "";
    this.#call("hairnet_on_opening");
    let url = isElsewhere ? `${host}, port ${port}` : this.#url;
    let socket: WebSocketLike;
    try {
      if (isElsewhere) url = urlAt(this.#url, host, port);
      socket = this.#makeSocket(url);
    } catch (error) {
      return this.#tellClosed(`no socket for ${url}: ${String(error)}`);
    }
    this.#listenTo(socket, url, isElsewhere);
    socket.onopen = () => this.#onOpen();
    if (this.#mayReconnect) socket.onbetter = (better) => this.#moveTo(better, url);
  }

  #onOpen(): void {
    this.#isOpen = true;
    this.#call("hairnet_on_open", Number(this.transport === "webtransport"));
    this.turn();
  }

  /** Continues the session over another socket, which is open. If the room cannot do so, it closes that socket. */
  #moveTo(socket: WebSocketLike, url: string): void {
    if (!this.#call("hairnet_replace_connection", this.#module.name("WebTransport is available now")))
      return socket.close();
    this.#drop();
    this.#call("hairnet_on_opening");
    this.#listenTo(socket, url, true);
    this.#onOpen();
  }

  #listenTo(socket: WebSocketLike, url: string, isElsewhere: boolean): void {
    this.#socket = socket;
    socket.binaryType = "arraybuffer";
    socket.onmessage = ({ data }) => {
      if (data instanceof ArrayBuffer) this.#take(new Uint8Array(data));
      else this.#end("the server sent text");
      this.turn();
    };
    // Browsers, and Node's ws, say after an error that the socket is closed. Node's own WebSocket does not when it
    // could not be opened.
    socket.onerror = () => {
      if (!this.#isOpen) setTimeout(() => socket.onclose?.({ code: 1006, reason: "" }));
    };
    socket.onclose = ({ code, reason }) => {
      socket.onclose = null;
      // The first attempt's failure is for people; later ones are temporary.
      if (!this.#isOpen && this.#answer && this.#isPlatforms && !isElsewhere) return this.#explain(socket);
      const error = reason || (code === 1006 || code === 1005 ? "" : `code ${code}`);
      const what = this.#isOpen ? "the connection broke" : `no server answers at ${url}`;
      this.#end(error ? `${what}: ${error}` : what);
      this.turn();
    };
  }

  /** Gives a packet that has arrived to the room. */
  #take(packet: Uint8Array): void {
    if (packet.length > this.#packet.byteCount) {
      this.#module.call("free", this.#packet.at);
      this.#packet = { at: this.#module.allocate(2 * packet.length), byteCount: 2 * packet.length };
    }
    this.#module.write(this.#packet.at, packet);
    this.#call("hairnet_on_packet", this.#packet.at, packet.length);
  }

  /** Finds out by a request why the first attempt failed, and then ends the attempt with that reason. */
  #explain(socket: WebSocketLike): void {
    void explainFailure(this.#url).then(({ code, detail }) => {
      if (this.#socket !== socket) return;
      this.#failure = code;
      this.#end(detail);
      this.turn();
    });
  }

  /** The server or the network has ended the connection, or it cannot be used any more. */
  #end(detail: string): void {
    const socket = this.#socket;
    if (!socket) return;
    this.#forget();
    socket.close();
    this.#tellClosed(detail);
  }

  #tellClosed(detail: string): void {
    this.#module.with(new TextEncoder().encode(`${detail}\0`), (error) => this.#call("hairnet_on_closed", error));
  }

  /** Listens to the socket no more. */
  #forget(): void {
    const socket = this.#socket;
    if (socket) socket.onopen = socket.onmessage = socket.onclose = socket.onbetter = null;
    this.#socket = null;
    this.#isOpen = false;
  }

  /** Settles the promise of `connect` once the room is connected, or closed for good. */
  #tellAnswer(): void {
    const answer = this.#answer;
    if (!answer) return;
    this.#module.call("hairnet_advance", this.room);
    const state = this.#module.call("hairnet_state", this.room);
    if (state !== LinkState.connected && state !== LinkState.closed) return;
    this.#answer = null;
    if (state === LinkState.connected) return answer.resolve();
    const end = this.takeEvents()
      .filter(({ kind }) => kind === EventKind.state)
      .at(-1);
    answer.reject(new HairnetError(end?.isRefused ? "refused" : this.#failure, end?.text ?? ""));
  }

  #setTimer(): void {
    if (this.#timer !== null) clearTimeout(this.#timer);
    this.#timer = null;
    const deadlineMs = Number(this.#module.callWide("hairnet_next_deadline", this.room) - this.#time()) / 1e6;
    const isFull = this.#socket !== null && this.#isOpen && this.#socket.bufferedAmount >= kBufferedBytesMax;
    const waitMs = isFull ? Math.min(kBufferedWaitMs, deadlineMs) : deadlineMs;
    // hairnet_next_deadline returns INT64_MAX ns, which is 9.2e12 ms, for a room that has ended.
    if (waitMs > 1e12) return;
    this.#timer = setTimeout(() => this.turn(), Math.ceil(Math.min(Math.max(waitMs, 0), kTimerMsMax)));
  }
}

/** A random trace, never 0: the logs of all servers name it, and the waits between attempts depend on it. */
function drawTrace(): bigint {
  const word = (): bigint => BigInt(Math.floor(Math.random() * 2 ** 32));
  return word() * 0x1_0000_0000n + word() || 1n;
}

function makePlatformSocket(
  url: string,
  choice: NonNullable<LinkOptions["transport"]>,
  memory: TransportMemory,
  nowNs: () => number,
): WebSocketLike {
  const hasWebTransport = typeof WebTransport !== "undefined";
  if (choice === "webtransport" && !hasWebTransport)
    throw new HairnetError("unsupported", "this platform, or a page that is not secure, has no WebTransport");
  if (choice === "websocket" || !hasWebTransport) return makeWebSocket(url);
  return new FallbackSocket(url, choice === "auto" ? makeWebSocket : null, memory, nowNs);
}

/** @internal */
export function makeWebSocket(url: string): WebSocketLike {
  if (typeof WebSocket === "undefined")
    throw new HairnetError("unsupported", "this platform has no WebSocket; give makeSocket");
  return new WebSocket(url, "hairnet") as WebSocketLike;
}

function monotonicNs(): number {
  return Math.round(1e6 * performance.now());
}
