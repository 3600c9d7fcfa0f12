import { connect, createServer, type Server, type Socket } from "node:net";
import type { AddressInfo } from "node:net";

/** A TCP relay with a delay and, from the server to the client, a rate that all connections share. */
export class SlowLine {
  /** The bytes that the server has sent so far. */
  bytes = 0;
  readonly #sockets = new Set<Socket>();
  readonly #server: Server;
  /** The time at which the line will have sent everything that it was given, ms of `performance.now()`. */
  #freeMs = 0;

  constructor(
    targetPort: number,
    private readonly bitsPerS: number,
    private readonly oneWayMs: number,
  ) {
    this.#server = createServer((client) => {
      const target = connect(targetPort, "127.0.0.1");
      for (const socket of [client, target]) {
        socket.setNoDelay(true);
        this.#sockets.add(socket);
        socket.on("error", () => socket.destroy());
        socket.on("close", () => this.#sockets.delete(socket));
      }
      this.#relay(client, target, Infinity);
      this.#relay(target, client, this.bitsPerS);
    });
  }

  async start(): Promise<void> {
    await new Promise<void>((done) => this.#server.listen(0, "127.0.0.1", done));
  }

  get port(): number {
    return (this.#server.address() as AddressInfo).port;
  }

  dispose(): void {
    for (const socket of this.#sockets) socket.destroy();
    this.#server.close();
  }

  /** Passes data on with the delay. `bitsPerS`: the rate; Infinity: this direction has no limit. */
  #relay(from: Socket, to: Socket, bitsPerS: number): void {
    let last = Promise.resolve();
    const at = (ms: number, then: () => void) => {
      last = last.then(() => new Promise((done) => setTimeout(done, ms - performance.now()))).then(then);
    };
    from.on("data", (data) => {
      const isDown = bitsPerS < Infinity;
      if (isDown) {
        this.bytes += data.length;
        // 8000 is 8 bits a byte and 1000 ms a second.
        this.#freeMs = Math.max(this.#freeMs, performance.now()) + (8000 * data.length) / bitsPerS;
      }
      // A sender that is faster than the line waits, as it would for a full buffer on the way.
      from.pause();
      at((isDown ? this.#freeMs : performance.now()) + this.oneWayMs, () => to.write(data));
      setTimeout(() => from.resume(), isDown ? this.#freeMs - performance.now() : 0);
    });
    from.on("end", () => at(performance.now() + this.oneWayMs, () => to.end()));
    from.on("close", () => at(performance.now() + this.oneWayMs, () => to.destroy()));
  }
}
