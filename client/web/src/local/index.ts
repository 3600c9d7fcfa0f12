/** hairnet-client/local: hair that the page simulates itself, without a server. */
export { buildLevels } from "./buildLevels";
export { LocalRoom, type LocalCharacterOptions, type LocalRoomOptions } from "./localRoom";
