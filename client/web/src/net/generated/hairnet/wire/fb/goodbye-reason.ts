export { GoodbyeReason } from "../../../../../generated/enums";
