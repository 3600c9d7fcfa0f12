/** The content of a frame that is a pose alone: all bones at rest. */
export function rigidContent(): Uint8Array {
  const bytes = new Uint8Array(11);
  bytes[0] = 0x60; // w is the largest part of the head's rotation; all that follows is 0
  return bytes;
}
