/** What is wrong; see `HairnetError`. */
export type ErrorCode =
  /** Bytes with wrong offsets, lengths or nesting. */
  | "malformed"
  /** Correct bytes, or an argument, with a value out of range or of another type. */
  | "invalid"
  /** An option or a property of that name does not exist. */
  | "unknown_option"
  /** More than a limit allows. */
  | "too_large"
  /** The platform, or the renderer, lacks something that the call needs. */
  | "unsupported"
  /** No server answers at the address, or it does not welcome this client in time. */
  | "unreachable"
  /** A server answers, but takes no WebSocket from pages of this page's origin. */
  | "origin_refused"
  /** A server that refuses this session permanently: its room, its token, its version. */
  | "refused";

/** The one kind of error that this package throws. `message` is one line for people; `code` is for programs. */
export class HairnetError extends Error {
  override readonly name = "HairnetError";

  constructor(
    readonly code: ErrorCode,
    message: string,
  ) {
    super(message);
  }
}

/** The message of what was thrown, whatever it is. */
export function messageOf(thrown: unknown): string {
  return thrown instanceof Error ? thrown.message : String(thrown);
}
