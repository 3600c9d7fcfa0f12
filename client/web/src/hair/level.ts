/** A mechanical model of a groom, the finest first; travels as its number. */
export enum LevelIndex {
  high = 0,
  medium = 1,
  low = 2,
  ether = 3,
  rigid = 4,
}

/** How finely frames are quantised. */
export enum ErrorClass {
  quarterMm = 0,
  halfMm = 1,
  oneMm = 2,
}

/** Metres a unit of displacement stands for, by error class. As floats, which is how servers reckon. */
export const kStepsM: readonly number[] = [0.25e-3, 0.5e-3, 1e-3].map(Math.fround);

/** A unit of velocity is so many steps a second. */
export const kVelocityStepsPerS = 32;
