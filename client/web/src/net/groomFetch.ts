import type { GroomFetched } from "./events";
import type { GroomHash } from "./groomHash";
import { hashGroom } from "./groomHash";
import type { GroomData, GroomRequest } from "./messages";

interface Fetch {
  readonly pieces: Uint8Array[];
  byteCount: number;
  /** of the whole file; 0: no piece has arrived */
  wholeByteCount: number;
}

/** The progress of grooms on their way, and of those that have arrived since none was. */
export interface Downloads {
  readonly bytes: number;
  /** of the files whose size is known */
  readonly byteCount: number;
}

/** Grooms of others on their way from the server, piece by piece, checked against their hashes. No I/O. */
export class GroomFetch {
  readonly #fetches = new Map<GroomHash, Fetch>();
  #arrivedBytes = 0;

  get downloads(): Downloads {
    let bytes = this.#arrivedBytes;
    let byteCount = this.#arrivedBytes;
    for (const fetch of this.#fetches.values()) {
      bytes += fetch.byteCount;
      byteCount += fetch.wholeByteCount;
    }
    return { bytes, byteCount };
  }

  /** The request to send, or null: it is on its way already. */
  request(hash: GroomHash): GroomRequest | null {
    if (this.#fetches.has(hash)) return null;
    if (this.#fetches.size === 0) this.#arrivedBytes = 0;
    this.#fetches.set(hash, { pieces: [], byteCount: 0, wholeByteCount: 0 });
    return { type: "groomRequest", hash, offset: 0 };
  }

  /** What there is to ask again over a new connection: each from where its pieces broke off. */
  requestAgain(): GroomRequest[] {
    return [...this.#fetches].map(([hash, fetch]) => ({ type: "groomRequest", hash, offset: fetch.byteCount }));
  }

  /** The whole groom, or what is wrong with it, once that is known. */
  take(data: GroomData): GroomFetched | null {
    const fetch = this.#fetches.get(data.hash);
    if (!fetch) return null; // refused or given up meanwhile
    if (data.offset > fetch.byteCount) return this.#fail(data.hash, "its pieces do not fit together");
    // Of a download that was given up, pieces may come after the request was repeated.
    const bytes = data.bytes.subarray(fetch.byteCount - data.offset);
    fetch.pieces.push(bytes);
    fetch.byteCount += bytes.length;
    fetch.wholeByteCount = data.byteCount;
    if (fetch.byteCount < data.byteCount) return null;
    const file = joined(fetch);
    if (hashGroom(file) !== data.hash) return this.#fail(data.hash, "its bytes are not those of its hash");
    this.#fetches.delete(data.hash);
    this.#arrivedBytes += file.length;
    return { type: "groomFetched", hash: data.hash, bytes: file, fault: "" };
  }

  /** The server does not have it, or sends no more grooms at once. False when it was not asked for. */
  refuse(hash: GroomHash): boolean {
    return this.#fetches.delete(hash);
  }

  #fail(hash: GroomHash, fault: string): GroomFetched {
    this.#fetches.delete(hash);
    return { type: "groomFetched", hash, bytes: null, fault };
  }
}

function joined(fetch: Fetch): Uint8Array {
  const bytes = new Uint8Array(fetch.byteCount);
  let at = 0;
  for (const piece of fetch.pieces) {
    bytes.set(piece, at);
    at += piece.length;
  }
  return bytes;
}
