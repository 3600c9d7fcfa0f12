/**
 * hairnet-client: other people's hair, simulated by a server, for browsers. `connect` joins a room, whose members have
 * poses, hair and looks; `hairnet-client/scene` draws them with three.js.
 */
export { HairnetError } from "./module/hairnetError";
export type { ErrorCode } from "./module/hairnetError";
export { changedAppearance, defaultAppearance, type Appearance } from "./hair/appearance";
export { Groom, type Body } from "./hair/groom";
export { LevelIndex } from "./hair/level";
export { nodeCount, type Basis, type Lattice, type MovedLattice, type MovedModes } from "./hair/movedLattice";
export { Bone, interpolatePose, kBoneCount, kNumbersPerBone, kPoseNumbers, poseError, rigidPose } from "./hair/pose";
export type { Pose } from "./hair/pose";
export type { Skin, SkinGrid } from "./hair/skin";
export type { HairSource, MemberImportance, ShownMember } from "./hair/hairSource";

export { Role, type LinkOptions } from "./net/linkOptions";
export type { TransportChoice } from "./net/fallbackSocket";
export type { Transport, WebSocketLike } from "./net/socket";
export { webSocketUrl } from "./net/url";

export * from "./room/index";
