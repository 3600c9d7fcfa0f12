import { GoodbyeReason } from "./messages";

const kFinal: ReadonlySet<GoodbyeReason> = new Set([
  GoodbyeReason.clientLeaves,
  GoodbyeReason.protocolError,
  GoodbyeReason.versionUnsupported,
  GoodbyeReason.tokenRefused,
  GoodbyeReason.sessionTakenOver,
  GoodbyeReason.removed,
]);

/** True when a reconnect is useless: every server would refuse this client again for the same reason. */
export function isFinal(reason: GoodbyeReason): boolean {
  return kFinal.has(reason);
}
