import type WebSocket from "ws";

/** What a server's `/wt.json` says: where it takes sessions, and the SHA-256 (32 bytes) of its certificate. */
export const kWebTransportPage = JSON.stringify({
  port: 7421,
  path: "/wt",
  hashes: [btoa(String.fromCharCode(...Array(32).fill(7)))],
});

/** The other end of a WebTransport session is the test. Put it in the place of the platform's `WebTransport`. */
export class FakeWebTransport {
  /** All sessions since `reset`, in the order in which the code under test made them. */
  static made: FakeWebTransport[] = [];
  /** What becomes of new sessions: they open, fail, or stay silent. */
  static fate: "open" | "fail" | "silence" = "open";
  /** The way in which this browser lets datagrams be sent: browsers differ. */
  static datagramsBy: "writable" | "createWritable" = "writable";
  /** With an open WebSocket the packets of sessions go to a server through it; with null they go to the test alone. */
  static relay: WebSocket | null = null;

  static reset(): void {
    Object.assign(FakeWebTransport, { made: [], fate: "open", datagramsBy: "writable", relay: null });
  }

  readonly ready: Promise<void>;
  readonly closed: Promise<{ closeCode: number; reason: string }>;
  /** What the code under test wrote to its stream. */
  readonly sent: Uint8Array[] = [];
  readonly datagramsSent: Uint8Array[] = [];
  /** The code under test has closed the session. */
  isClosed = false;
  /** The code under test has ended its stream, which carries what must arrive. */
  streamEnded = false;
  readonly datagrams;
  readonly incomingUnidirectionalStreams;
  readonly #relay = FakeWebTransport.relay;
  #end!: (info: { closeCode: number; reason: string }) => void;
  #refuse!: (error: Error) => void;
  #stream!: ReadableStreamDefaultController<Uint8Array>;
  #incoming!: ReadableStreamDefaultController<Uint8Array>;
  #streams!: ReadableStreamDefaultController<ReadableStream<Uint8Array>>;

  constructor(
    readonly url: string,
    readonly options: { serverCertificateHashes?: { algorithm: string; value: Uint8Array }[] },
  ) {
    FakeWebTransport.made.push(this);
    this.#relay?.on("message", (bytes: Buffer) => this.tell(new Uint8Array(bytes)));
    this.ready = new Promise((resolve, reject) => {
      this.#refuse = reject;
      if (FakeWebTransport.fate === "open") resolve();
      if (FakeWebTransport.fate === "fail") reject(new Error("refused"));
    });
    this.ready.catch(() => {});
    this.closed = new Promise((resolve) => {
      this.#end = resolve;
    });
    this.incomingUnidirectionalStreams = new ReadableStream<ReadableStream<Uint8Array>>({
      start: (controller) => {
        this.#streams = controller;
      },
    });
    const writable = () => new WritableStream<Uint8Array>({ write: (bytes) => this.#take(bytes, this.datagramsSent) });
    // Datagrams of Hairnet have at most kDatagramBytesMax bytes (1024), so each of them fits into 1200. The code under
    // test raises the mark.
    this.datagrams = {
      maxDatagramSize: 1200,
      incomingHighWaterMark: 1,
      readable: new ReadableStream<Uint8Array>({
        start: (controller) => {
          this.#incoming = controller;
        },
      }),
      ...(FakeWebTransport.datagramsBy === "writable" ? { writable: writable() } : { createWritable: writable }),
    };
  }

  createBidirectionalStream() {
    return Promise.resolve({
      readable: new ReadableStream<Uint8Array>({
        start: (controller) => {
          this.#stream = controller;
        },
      }),
      writable: new WritableStream<Uint8Array>({
        write: (bytes) => this.#take(bytes, this.sent),
        close: () => {
          this.streamEnded = true;
        },
      }),
    });
  }

  #take(bytes: Uint8Array, taken: Uint8Array[]): void {
    taken.push(bytes);
    this.#relay?.send(bytes);
  }

  close(): void {
    this.isClosed = true;
    this.#relay?.close();
    this.#refuse(new Error("closed"));
  }

  /** The server's bytes on the stream of the session. */
  tell(bytes: Uint8Array): void {
    this.#stream.enqueue(bytes);
  }
  /** The server opens a one-way stream, as it does for each download. */
  openStream(): ReadableStreamDefaultController<Uint8Array> {
    let opened!: ReadableStreamDefaultController<Uint8Array>;
    this.#streams.enqueue(
      new ReadableStream<Uint8Array>({
        start: (controller) => {
          opened = controller;
        },
      }),
    );
    return opened;
  }
  tellDatagram(bytes: Uint8Array): void {
    this.#incoming.enqueue(bytes);
  }
  /** The server ends the session. */
  end(reason: string): void {
    this.#end({ closeCode: 0, reason });
  }
}
