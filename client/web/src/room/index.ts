export { materials } from "./materials";
export { Member } from "./member";
export { OwnCharacter } from "./ownCharacter";
export { connect, Room, type CharacterOptions, type RoomEvents, type RoomState } from "./room";
export type { WindOptions } from "./wind";
