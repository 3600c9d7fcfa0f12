export { materials } from "./materials";
export { Member } from "./member";
export { OwnCharacter, type CharacterOptions } from "./ownCharacter";
export { connect, Room, type RoomCounters, type RoomEvents, type RoomOptions, type RoomState } from "./room";
export type { WindOptions } from "./wind";
