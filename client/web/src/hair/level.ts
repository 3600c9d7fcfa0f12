/** A mechanical model of a groom, the finest first; sent as its number. */
export enum LevelIndex {
  high = 0,
  medium = 1,
  low = 2,
  ether = 3,
  rigid = 4,
}

/** The step of a frame's quantisation. */
export enum ErrorClass {
  quarterMm = 0,
  halfMm = 1,
  oneMm = 2,
}

/** Metres in a unit of displacement, by error class. Rounded to float, as on servers. */
export const kStepsM: readonly number[] = [0.25e-3, 0.5e-3, 1e-3].map(Math.fround);

/** A unit of velocity is this many steps a second. */
export const kVelocityStepsPerS = 32;
