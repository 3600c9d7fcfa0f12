export { GroomState } from "../../../../../generated/enums";
