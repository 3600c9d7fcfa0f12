/**
 * hairnet-client: other people's hair, simulated by a server, for browsers. `Link` talks to the server, `Playout`
 * computes what to show of a character at any moment, `Deformer` moves its points on the CPU. `hairnet-client/scene`
 * draws it with three.js.
 */
export { HairnetError } from "./hair/hairnetError";
export type { ErrorCode } from "./hair/hairnetError";
export { changedAppearance, defaultAppearance, type Appearance } from "./hair/appearance";
export { LevelIndex } from "./hair/level";
export { Bone, interpolatePose, kBoneCount, kNumbersPerBone, kPoseNumbers, poseFault, rigidPose } from "./hair/pose";
export type { Pose } from "./hair/pose";
export { expandDisplacements, nodeCount, nodePosition } from "./hair/lattice";
export type { Lattice, LevelGeometry } from "./hair/lattice";
export { ModeLattice, type MovedLattice, type MovedModes } from "./hair/movedLattice";
export type { Frame } from "./hair/frame";
export { displacementsOf } from "./hair/basis";
export type { Basis, HairBasis } from "./hair/basis";
export { Playout } from "./hair/playout";
export type { PlayoutSample } from "./hair/playout";
export { Deformer } from "./hair/deform";
export { StrandLengths } from "./hair/strandLengths";
export { SkinPush, type SkinGrid } from "./hair/skinPush";
export type { Skin, SkinDistanceField } from "./hair/skin";
export type { DeformOutput, FfdKind } from "./hair/deform";
export { blendAt, farCardBlend, rootBlend } from "./hair/rootBlend";
export { farCardNormals, farCardTangents, restTangents } from "./hair/restTangents";
export type { RestTangents } from "./hair/restTangents";
export { validateGroom } from "./hair/validateGroom";
export type * from "./hair/groom";

export { decodeGroom } from "./net/groomFile";
export type { Downloads } from "./net/groomFetch";
export { hashGroom } from "./net/groomHash";
export type { GroomHash } from "./net/groomHash";
export { Link, webSocketUrl } from "./net/link";
export type { LinkOptions, Transport, WebSocketLike } from "./net/link";
export type { TransportChoice } from "./net/fallbackSocket";
export { LinkCore } from "./net/linkCore";
export type { LinkCounters, LinkCoreOptions } from "./net/linkCoreOptions";
export type * from "./net/events";
export {
  ErrorReason,
  GoodbyeReason,
  GroomState,
  ModerateAction,
  ObserveMode,
  Role,
  kProtocolVersion,
} from "./net/messages";
export type {
  CharacterAdded,
  CharacterRemoved,
  ErrorMessage,
  GroomStatus,
  MaterialScale,
  MemberChanged,
  MemberImportance,
  MemberJoined,
  MemberLeft,
  Moderate,
  Observe,
  PoseSample,
  RoomWind,
  Welcome,
  Wind,
} from "./net/messages";
export { decodePacket, encodePacket } from "./net/packet";
export type { ClientMessage, Envelope, Message, ServerMessage } from "./net/messages";

export { connect, materials, Member, OwnCharacter, Room } from "./room/index";
export type { CharacterOptions, RoomCounters, RoomEvents, RoomOptions, RoomState, WindOptions } from "./room/index";
