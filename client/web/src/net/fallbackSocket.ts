import { HairnetError, messageOf } from "../module/hairnetError";
import type { Transport, WebSocketLike } from "./socket";
import { readWebTransportPage, webTransportPageUrl, WebTransportSocket } from "./webTransportSocket";

// Networks that drop UDP do so silently: after this time without a session a WebSocket is tried.
const kWebTransportMs = 3000;
// After an attempt that opened no session, WebTransport is not tried again for this time.
const kBlockedMs = 60_000;

/** "auto": WebTransport where browser, server and network have it, else a WebSocket. */
export type TransportChoice = "auto" | "webtransport" | "websocket";

/** What one attempt learns for the next ones; the caller keeps it from socket to socket. */
export interface TransportMemory {
  /** WebTransport is not tried before this time, ns, because the server offered it and no session opened. */
  blockedUntilNs: number;
  /** Why the last attempt that failed had no WebTransport, in one line; null: no attempt has failed. */
  reason: string | null;
}

/**
 * A socket that is a WebTransport session, or a WebSocket where no session opens in time. Where a server offers
 * WebTransport and no session opened, it tries again every kBlockedMs, and tells `onbetter` of a session that opens.
 * The members are those of `WebSocketLike` (socket.ts).
 */
export class FallbackSocket implements WebSocketLike {
  binaryType = "arraybuffer";
  onopen: ((event: never) => unknown) | null = null;
  onmessage: ((event: { readonly data: unknown }) => unknown) | null = null;
  onerror: ((event: never) => unknown) | null = null;
  onclose: ((event: { readonly code: number; readonly reason: string }) => unknown) | null = null;
  onbetter: ((socket: WebSocketLike) => unknown) | null = null;
  /** Aborted by `close`; it ends attempts that are still going on. */
  readonly #closing = new AbortController();
  /** The socket in use; null: none has been chosen yet. */
  #socket: WebSocketLike | null = null;
  #fallbackReason: string | null = null;
  #retryTimer: ReturnType<typeof setTimeout> | undefined;

  /** `makeWebSocket` null: no WebSocket, so a failure of WebTransport ends this socket. `nowNs`: a monotonic clock. */
  constructor(
    private readonly url: string,
    private readonly makeWebSocket: ((url: string) => WebSocketLike) | null,
    private readonly memory: TransportMemory,
    private readonly nowNs: () => number,
  ) {
    void this.#start();
  }

  get bufferedAmount(): number {
    return this.#socket?.bufferedAmount ?? 0;
  }

  get transport(): Transport {
    return this.#socket?.transport ?? "websocket";
  }

  get fallbackReason(): string | null {
    return this.#fallbackReason;
  }

  send(bytes: Uint8Array): void {
    this.#socket?.send(bytes);
  }

  sendDatagram(bytes: Uint8Array): boolean {
    return this.#socket?.sendDatagram?.(bytes) ?? false;
  }

  close(): void {
    this.#closing.abort();
    clearTimeout(this.#retryTimer);
    this.#socket?.close();
  }

  async #start(): Promise<void> {
    try {
      if (this.#isBlocked) throw new HairnetError("unreachable", this.memory.reason ?? "");
      const socket = await this.#openWebTransport();
      if (this.#isClosed) return socket.close();
      this.#useSocket(socket);
      this.onopen?.(undefined as never);
    } catch (error) {
      if (this.#isClosed) return;
      const reason = messageOf(error);
      if (this.makeWebSocket) {
        this.#fallbackReason = this.memory.reason = reason;
        this.#useSocket(this.makeWebSocket(this.url));
        if (this.#isBlocked) this.#tryLater();
      } else {
        this.onclose?.({ code: 1006, reason: `no WebTransport: ${reason}` });
      }
    }
  }

  /** Tries WebTransport again once it is not blocked any more. */
  #tryLater(): void {
    this.#retryTimer = setTimeout(() => void this.#tryAgain(), (this.memory.blockedUntilNs - this.nowNs()) / 1e6);
  }

  /** Tries WebTransport once more if somebody listens for a better socket, and plans the attempt after it. */
  async #tryAgain(): Promise<void> {
    const socket = this.onbetter ? await this.#openWebTransport().catch(() => null) : null;
    if (this.#isClosed) return socket?.close();
    // The next attempt waits also after a session that has opened, because sessions may open here and not last.
    this.#block();
    this.#tryLater();
    if (socket) this.onbetter?.(socket);
  }

  /** Opens a session within `kWebTransportMs`, or rejects with the reason. */
  async #openWebTransport(): Promise<WebTransportSocket> {
    const attempt = new AbortController();
    const stop = () => attempt.abort();
    let isTooLate = false;
    const timer = setTimeout(() => {
      isTooLate = true;
      stop();
    }, kWebTransportMs);
    this.#closing.signal.addEventListener("abort", stop);
    try {
      return await this.#openSession(attempt.signal);
    } catch (error) {
      throw isTooLate ? new HairnetError("unreachable", `no session opened within ${kWebTransportMs / 1000} s`) : error;
    } finally {
      clearTimeout(timer);
      this.#closing.signal.removeEventListener("abort", stop);
    }
  }

  async #openSession(signal: AbortSignal): Promise<WebTransportSocket> {
    const options: RequestInit = { cache: "no-store", credentials: "omit", signal };
    const response = await fetch(webTransportPageUrl(this.url), options);
    if (!response.ok) throw new HairnetError("unsupported", "the server does not know it");
    const page = readWebTransportPage(await response.text());
    if (!page) throw new HairnetError("unsupported", "the server has none");
    try {
      return await WebTransportSocket.open(this.url, page, signal);
    } catch (error) {
      // The server offers WebTransport and no session opened. Without a pause each reconnection would wait for it
      // again.
      if (!this.#isClosed) this.#block();
      throw error;
    }
  }

  get #isClosed(): boolean {
    return this.#closing.signal.aborted;
  }
  get #isBlocked(): boolean {
    return this.nowNs() < this.memory.blockedUntilNs;
  }
  /** Lets nobody try WebTransport for kBlockedMs. */
  #block(): void {
    this.memory.blockedUntilNs = this.nowNs() + 1e6 * kBlockedMs;
  }

  #useSocket(socket: WebSocketLike): void {
    this.#socket = socket;
    socket.binaryType = this.binaryType;
    socket.onopen = (event) => this.onopen?.(event);
    socket.onmessage = (event) => this.onmessage?.(event);
    socket.onerror = (event) => this.onerror?.(event);
    socket.onclose = (event) => this.onclose?.(event);
  }
}
