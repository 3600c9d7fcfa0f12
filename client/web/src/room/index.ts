export { materials, type MaterialScale } from "./materials";
export { Member } from "./member";
export { OwnCharacter, type CharacterOptions } from "./ownCharacter";
export { People, type RoomEvents, type RoomState } from "./people";
export { connect, ModerateAction, Room, type Downloads, type RoomCounters, type RoomOptions } from "./room";
export { PropShape, Release, TouchAudience, type Hand, type HandShape, type Prop } from "./touch";
export type { Wind, WindOptions } from "./wind";
