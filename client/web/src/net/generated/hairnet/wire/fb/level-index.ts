export { LevelIndex } from "../../../../../generated/enums";
