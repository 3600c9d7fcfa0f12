export type { FrameOptions } from "./frameCamera";
export { HairCharacter } from "./hairCharacter";
export type { HairPart } from "./hairMaterials";
export { HairScene, type HairSceneEventMap, type HairSceneOptions, type HairStatistics } from "./hairScene";
export type { HairSource, MemberImportance, ShownMember } from "../hair/hairSource";
export type { MovedLattice } from "../hair/movedLattice";
export { detailFor, type DrawDetail } from "./drawDetail";
export { Picture } from "./picture";
export { shader } from "./shaders";
