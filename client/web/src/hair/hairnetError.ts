/** Why something was refused; see `HairnetError`. */
export type FaultKind =
  /** Bytes that are not what they say they are: offsets, lengths, nesting. */
  | "malformed"
  /** Sound bytes, or an argument, with a value out of range. */
  | "invalid"
  /** More than a limit allows. */
  | "too_large"
  /** A server that could not be joined. */
  | "unreachable"
  /** A server that will not have this session, now or later: its room, its token, its version. */
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
