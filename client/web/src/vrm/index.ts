export { fitHead, kNoFit, type HeadFit } from "./headFit";
export { VrmHair, type VrmHairOptions } from "./vrmHair";
export { findHairMeshes } from "./vrmHairMeshes";
export { VrmSkeleton } from "./vrmSkeleton";
