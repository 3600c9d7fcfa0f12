import { HairnetError } from "../hair/hairnetError";
import type { Transport, WebSocketLike } from "./link";
import { readWebTransportPage, webTransportPageUrl, WebTransportSocket } from "./webTransportSocket";

// Networks that drop UDP say nothing: after this time the WebSocket is tried.
const kWebTransportMs = 3000;
// So long after such an attempt, reconnects do without WebTransport.
const kBlockedNs = 60e9;

/** "auto": WebTransport where browser, server and network have it, else a WebSocket. */
export type TransportChoice = "auto" | "webtransport" | "websocket";

/** What one attempt learns for the next ones. */
export interface TransportMemory {
  /** Until then WebTransport is not tried: the server offered it, but no session opened. */
  blockedUntilNs: number;
  /** why WebTransport was not to be had, in one line */
  reason: string | null;
}

/** A socket that is a WebTransport session, or a WebSocket where that is not to be had in time. */
export class FallbackSocket implements WebSocketLike {
  binaryType = "arraybuffer";
  onopen: ((event: never) => unknown) | null = null;
  onmessage: ((event: { readonly data: unknown }) => unknown) | null = null;
  onerror: ((event: never) => unknown) | null = null;
  onclose: ((event: { readonly code: number; readonly reason: string }) => unknown) | null = null;
  readonly #attempt = new AbortController();
  #socket: WebSocketLike | null = null;
  #fallbackReason: string | null = null;
  #isTooLate = false;
  #isClosed = false;

  /** `makeWebSocket`: null: never. `nowNs`: a monotonic clock. */
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
    this.#isClosed = true;
    this.#attempt.abort();
    this.#socket?.close();
  }

  async #start(): Promise<void> {
    const timer = setTimeout(() => {
      this.#isTooLate = true;
      this.#attempt.abort();
    }, kWebTransportMs);
    try {
      if (this.nowNs() < this.memory.blockedUntilNs) throw new HairnetError("unreachable", this.memory.reason ?? "");
      const socket = await this.#openWebTransport(this.#attempt.signal);
      if (this.#isClosed) return socket.close();
      this.#adopt(socket);
      this.onopen?.(undefined as never);
    } catch (error) {
      if (this.#isClosed) return;
      const reason = this.#reasonOf(error);
      if (this.makeWebSocket) {
        this.#fallbackReason = this.memory.reason = reason;
        this.#adopt(this.makeWebSocket(this.url));
      } else {
        this.onclose?.({ code: 1006, reason: `no WebTransport: ${reason}` });
      }
    } finally {
      clearTimeout(timer);
    }
  }

  async #openWebTransport(signal: AbortSignal): Promise<WebTransportSocket> {
    const options: RequestInit = { cache: "no-store", credentials: "omit", signal };
    const response = await fetch(webTransportPageUrl(this.url), options);
    if (!response.ok) throw new HairnetError("unsupported", "the server does not know it");
    const page = readWebTransportPage(await response.text());
    if (!page) throw new HairnetError("unsupported", "the server has none");
    try {
      return await WebTransportSocket.open(this.url, page, signal);
    } catch (error) {
      if (!this.#isClosed) this.memory.blockedUntilNs = this.nowNs() + kBlockedNs;
      throw error;
    }
  }

  #reasonOf(error: unknown): string {
    if (this.#isTooLate) return `no session opened within ${kWebTransportMs / 1000} s`;
    return error instanceof Error ? error.message : String(error);
  }

  #adopt(socket: WebSocketLike): void {
    this.#socket = socket;
    socket.binaryType = this.binaryType;
    socket.onopen = (event) => this.onopen?.(event);
    socket.onmessage = (event) => this.onmessage?.(event);
    socket.onerror = (event) => this.onerror?.(event);
    socket.onclose = (event) => this.onclose?.(event);
  }
}
