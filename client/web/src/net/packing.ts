import * as flatbuffers from "flatbuffers";
import { inflateSync } from "fflate";
import { HairnetError } from "../hair/hairnetError";
import { layouts } from "./generated/layout";
import * as fb from "./generated/messages";
import { kGroomBytesMax, kPacketBytesMin } from "./messages";
import { hasIdentifier, verifyBuffer } from "./verify";

// A match of 258 bytes takes two bits at least.
const kDeflateRatioMax = 1032;

/** Identifiers of packed files: a table, deflated. */
export const kPackedGroom = "HNGZ";
export const kPackedBasis = "HNBZ";
export const kPackedLearnt = "HNLZ";

export function isPacked(file: Uint8Array, identifier: string): boolean {
  return hasIdentifier(file, identifier);
}

/** The table in a packed file. It takes no more memory than the file says, and says no more than deflate can do. */
export function unpack(file: Uint8Array, identifier: string): Uint8Array {
  const aligned = file.byteOffset % 8 === 0 ? file : file.slice();
  verifyBuffer(aligned, identifier, "PackedTable", layouts);
  const root = fb.PackedTable.getSizePrefixedRootAsPackedTable(new flatbuffers.ByteBuffer(aligned));
  const stream = root.streamArray()!;
  const byteCount = root.unpackedBytes();
  if (byteCount > kGroomBytesMax)
    throw new HairnetError("too_large", `${byteCount} bytes when unpacked, more than the limit of ${kGroomBytesMax}`);
  if (byteCount < kPacketBytesMin || Math.floor(byteCount / kDeflateRatioMax) > stream.length)
    throw damaged("its stream cannot be as long as it says");
  // fflate drops what does not fit: one byte more shows that there was too much. It also overlooks bytes after the end of
  // the stream: then the stream ends without its last byte, too.
  const out = new Uint8Array(byteCount + 1);
  if (inflated(stream.subarray(0, -1), out)) throw damaged("its stream is not as long as it says");
  const table = inflated(stream, out);
  if (!table) throw damaged("its stream is damaged");
  if (table.length !== byteCount) throw damaged("its stream is not as long as it says");
  return table;
}

/** Null when the stream is damaged, or does not end. */
function inflated(stream: Uint8Array, out: Uint8Array): Uint8Array | null {
  try {
    return inflateSync(stream, { out });
  } catch {
    return null;
  }
}

function damaged(why: string): HairnetError {
  return new HairnetError("malformed", `not whole: ${why}`);
}
