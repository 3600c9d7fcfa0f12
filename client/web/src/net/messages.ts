import type { ClientMessage } from "./clientMessages";
import type { ServerMessage } from "./serverMessages";

// The messages between client and server.

export type * from "./clientMessages";
export type * from "./serverMessages";
export * from "../generated/limits";
export {
  ErrorReason,
  GoodbyeReason,
  GroomState,
  ModerateAction,
  ObserveMode,
  Role,
  kErrorReasonLast,
  kGoodbyeReasonLast,
} from "../generated/enums";

export type Message = ClientMessage | ServerMessage;

/** The unit on every transport: a message and its sender's monotonic clock. */
export interface Envelope {
  readonly clockNs: number;
  readonly message: Message;
}
