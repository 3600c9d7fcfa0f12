/**
 * Decides when bulk data (groom chunks) may go before urgent messages (poses, answers) on one connection. Usually bulk
 * is sent when nothing urgent waits. On a slow line that is always busy, bulk still gets at least one byte in four.
 */
export class BulkScheduler {
  /** sent since the last piece, while one waited */
  #creditBytes = 0;

  constructor(private readonly pieceBytes: number) {}

  sentSoon(bytes: number, bulkWaits: boolean): void {
    this.#creditBytes = bulkWaits ? this.#creditBytes + bytes : 0;
  }

  sentBulk(): void {
    this.#creditBytes = 0;
  }

  get isDue(): boolean {
    return this.#creditBytes >= 3 * this.pieceBytes;
  }
}
