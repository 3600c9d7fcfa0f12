export { ModerateAction } from "../../../../../generated/enums";
