// Limits of the protocol (schema/PROTOCOL.md).

export const kProtocolVersion = 3;
export const kPacketBytesMax = 4 << 20;
export const kGroomChunkBytesMax = 256 << 10;
export const kGroomBytesMax = 256 << 20;
export const kPosesPerBatchMax = 4096;
export const kMembersPerMessageMax = 4096;
export const kHairStateIntegersMax = 3 << 18;
export const kRoomNameBytesMax = 64;
export const kTokenBytesMax = 4096;
export const kObserveRadiusMaxM = 20_000;
export const kHairStateStepMaxM = Math.fround(1e-3);
export const kScreenHeightMax = 100;
export const kTickRateMaxHz = 1000;
/** Any time, absolute: 73 years. */
export const kTimeMaxNs = 2 ** 61;
