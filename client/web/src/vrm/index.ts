export { fitHead, kNoFit, type HeadFit, type HeadFitChange } from "./headFit";
export { kVrmBytesMax, loadVrm } from "./loadVrm";
export { lowerArms } from "./lowerArms";
export { VrmHair, type VrmHairOptions } from "./vrmHair";
export { findHairBones, findHairMeshes } from "./vrmHairMeshes";
export { VrmSkeleton } from "./vrmSkeleton";
