import type { GroomHash } from "./groomHash";
import type { GroomChunk, GroomNeed, GroomOffer } from "./messages";

interface Upload {
  readonly bytes: Uint8Array;
  sentBytes: number;
}

/** Groom bytes on their way to the server, chunk by chunk as it asks for them. No I/O. */
export class UploadQueue {
  readonly #uploads = new Map<GroomHash, Upload>();
  /** by when they were asked for */
  #wanted: GroomHash[] = [];

  constructor(private readonly chunkBytes: number) {}

  /** The offer to send, or null: this groom is on its way already. */
  offer(hash: GroomHash, bytes: Uint8Array): GroomOffer | null {
    if (this.#uploads.has(hash)) return null;
    this.#uploads.set(hash, { bytes, sentBytes: 0 });
    return { type: "groomOffer", hash, byteCount: bytes.length };
  }

  /**
   * The server wants the bytes from `need.offset` on, or with the groom's size none now: another client may be sending
   * them, and should it leave, the server asks again. False for an unknown groom, or an offset beyond it.
   */
  need(need: GroomNeed): boolean {
    const upload = this.#uploads.get(need.hash);
    if (!upload || need.offset > upload.bytes.length) return false;
    this.#wanted = this.#wanted.filter((hash) => hash !== need.hash);
    upload.sentBytes = need.offset;
    if (need.offset < upload.bytes.length) this.#wanted.push(need.hash);
    return true;
  }

  /** The server has all of it, or refused it: drops the bytes. */
  drop(hash: GroomHash): void {
    this.#uploads.delete(hash);
    this.#wanted = this.#wanted.filter((wanted) => wanted !== hash);
  }

  clear(): void {
    this.#uploads.clear();
    this.#wanted = [];
  }

  get isWaiting(): boolean {
    return this.#wanted.length > 0;
  }

  /** The next piece of the groom that has been asked for longest; null when nothing is wanted. */
  nextChunk(): GroomChunk | null {
    if (this.#wanted.length === 0) return null;
    const hash = this.#wanted[0];
    const upload = this.#uploads.get(hash)!;
    const offset = upload.sentBytes;
    const bytes = upload.bytes.subarray(offset, offset + this.chunkBytes);
    upload.sentBytes += bytes.length;
    if (upload.sentBytes === upload.bytes.length) this.#wanted.shift();
    return { type: "groomChunk", hash, offset, bytes };
  }
}
