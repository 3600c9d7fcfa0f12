export { ErrorClass, LevelIndex } from "../generated/enums";

/** Metres in a unit of displacement, by error class. Rounded to float, as on servers. */
export const kStepsM: readonly number[] = [0.25e-3, 0.5e-3, 1e-3].map(Math.fround);

/** A unit of velocity is this many steps a second. */
export const kVelocityStepsPerS = 32;
