import { HairnetError } from "../hair/hairnetError";
import type { Transport, WebSocketLike } from "./link";
import { readWebTransportPage, webTransportPageUrl, WebTransportSocket } from "./webTransportSocket";

// Networks that drop UDP say nothing: after this time the WebSocket is tried.
const kWebTransportMs = 3000;

/** "auto": WebTransport where browser, server and network have it, else a WebSocket. */
export type TransportChoice = "auto" | "webtransport" | "websocket";

/** What one attempt learns for the next ones. */
export interface TransportMemory {
  /** The server offered WebTransport, but no session opened: the network drops UDP. */
  isBlocked: boolean;
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
  #isClosed = false;

  /** `makeWebSocket`: null: never. */
  constructor(
    private readonly url: string,
    private readonly makeWebSocket: ((url: string) => WebSocketLike) | null,
    private readonly memory: TransportMemory,
  ) {
    void this.#start();
  }

  get bufferedAmount(): number {
    return this.#socket?.bufferedAmount ?? 0;
  }

  get transport(): Transport {
    return this.#socket?.transport ?? "websocket";
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
    const timer = setTimeout(() => this.#attempt.abort(), kWebTransportMs);
    try {
      const socket = await this.#openWebTransport(this.#attempt.signal);
      if (this.#isClosed) return socket.close();
      this.#adopt(socket);
      this.onopen?.(undefined as never);
    } catch (error) {
      if (this.#isClosed) return;
      if (this.makeWebSocket) this.#adopt(this.makeWebSocket(this.url));
      else this.onclose?.({ code: 1006, reason: `no WebTransport: ${String(error)}` });
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
      this.memory.isBlocked = !this.#isClosed;
      throw error;
    }
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
