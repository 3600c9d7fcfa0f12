export { Role } from "../../../../../generated/enums";
