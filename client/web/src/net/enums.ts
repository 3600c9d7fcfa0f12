// Numbers of the protocol that have names; they travel as one byte.

export enum ErrorReason {
  none,
  malformed,
  versionUnsupported,
  unexpectedMessage,
  limitExceeded,
  groomUnknown,
  groomInvalid,
  groomHashMismatch,
  groomBuildQueueFull,
  characterUnknown,
  characterExists,
  levelInvalid,
  poseInvalid,
  materialInvalid,
  windInvalid,
  notAllowed,
  tokenInvalid,
  roomInvalid,
  observeInvalid,
  stateInvalid,
  groomUnavailable,
}
export const kErrorReasonLast = ErrorReason.groomUnavailable;

export enum GoodbyeReason {
  none,
  clientLeaves,
  serverDraining,
  protocolError,
  versionUnsupported,
  handshakeTimeout,
  idleTimeout,
  slowConsumer,
  serverFull,
  overRate,
  tokenRefused,
  roomRefused,
  sessionTakenOver,
}
export const kGoodbyeReasonLast = GoodbyeReason.sessionTakenOver;

export enum Role {
  participant,
  /** has no characters of its own */
  observer,
}

export enum ObserveMode {
  all,
  nearest,
  radius,
  list,
}

export enum GroomState {
  queued,
  building,
  ready,
  refused,
}
