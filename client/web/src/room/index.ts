export { Member } from "./member";
export { OwnCharacter } from "./ownCharacter";
export { connect, Room, type RoomEvents, type RoomState } from "./room";
