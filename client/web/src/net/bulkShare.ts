/**
 * When bulk (pieces of grooms) goes before what must go soon (poses, answers) on one connection. As a rule it goes when
 * nothing else waits. Where something always does, on a thin line, it gets at least one byte in four all the same.
 */
export class BulkShare {
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
