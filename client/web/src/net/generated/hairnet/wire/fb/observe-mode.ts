export { ObserveMode } from "../../../../../generated/enums";
