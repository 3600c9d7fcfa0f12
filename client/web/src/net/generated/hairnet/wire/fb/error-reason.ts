export { ErrorReason } from "../../../../../generated/enums";
