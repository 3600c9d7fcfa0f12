/** The kind of a fault; see `HairnetError`. */
export type FaultKind =
  /** Bytes with wrong offsets, lengths or nesting. */
  | "malformed"
  /** Correct bytes, or an argument, with a value out of range. */
  | "invalid"
  /** More than a limit allows. */
  | "too_large"
  /** A server that could not be joined. */
  | "unreachable"
  /** A server that refuses this session permanently: its room, its token, its version. */
  | "refused";

/** The one kind of error that this package throws. `message` is one line. */
export class HairnetError extends Error {
  override readonly name = "HairnetError";

  constructor(
    readonly kind: FaultKind,
    message: string,
  ) {
    super(message);
  }
}
