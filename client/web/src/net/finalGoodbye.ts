import { GoodbyeReason } from "./messages";

const kFinal: ReadonlySet<GoodbyeReason> = new Set([
  GoodbyeReason.clientLeaves,
  GoodbyeReason.protocolError,
  GoodbyeReason.versionUnsupported,
  GoodbyeReason.tokenRefused,
  GoodbyeReason.sessionTakenOver,
]);

/** The same client would be refused again, by the same server or the next. */
export function isFinal(reason: GoodbyeReason): boolean {
  return kFinal.has(reason);
}
