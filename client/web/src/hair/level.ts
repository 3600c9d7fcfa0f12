export { ErrorClass, LevelIndex } from "../generated/enums";

/** Metres a unit of displacement stands for, by error class. As floats, which is how servers reckon. */
export const kStepsM: readonly number[] = [0.25e-3, 0.5e-3, 1e-3].map(Math.fround);

/** A unit of velocity is so many steps a second. */
export const kVelocityStepsPerS = 32;
