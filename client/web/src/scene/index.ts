export { HairCharacter } from "./hairCharacter";
export type { HairPart } from "./hairMaterials";
export { HairScene, type HairSceneEventMap, type HairSceneOptions, type HairStatistics } from "./hairScene";
export type { HairSource, LatticeLayer, MemberImportance, ShownMember } from "./hairSource";
export { detailFor, type DrawDetail } from "./drawDetail";
export { shader } from "./shaders";
