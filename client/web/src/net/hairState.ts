import { kHairStateIntegersMax, kHairStateStepMaxM } from "../generated/limits";
import { LevelIndex } from "../hair/level";
import * as fb from "./generated/messages";
import { checkInteger, enumOf, invalid, type Builder, type Offset } from "./messageCodec";

/** A lattice: displacement = stepM * integer, velocity = 32 stepM/s * integer, 3 an active node. */
export interface HairState {
  readonly level: LevelIndex;
  readonly stepM: number;
  readonly displacements: Int16Array;
  /** as many, or none: at rest */
  readonly velocities: Int16Array;
}

function writeShorts(to: Builder, integers: Int16Array): Offset {
  to.startVector(2, integers.length, 2);
  for (let i = integers.length - 1; i >= 0; --i) to.addInt16(integers[i]);
  return to.endVector();
}

/** @internal Types of the package do not show generated code. */
export function writeState(to: Builder, state: HairState): Offset {
  const displacements = writeShorts(to, state.displacements);
  const velocities = writeShorts(to, state.velocities);
  return fb.HairState.createHairState(to, displacements, velocities, state.stepM, state.level);
}

/** @internal Types of the package do not show generated code. */
export function readState(from: fb.HairState): HairState {
  const count = from.displacementsLength();
  if (count > kHairStateIntegersMax) throw invalid(`hair state: more than ${kHairStateIntegersMax} integers`);
  if (from.velocitiesLength() !== 0 && from.velocitiesLength() !== count) throw invalid("hair state: counts differ");
  return {
    level: enumOf(from.level(), LevelIndex.high, LevelIndex.ether, "level of a hair state"),
    stepM: from.stepM(),
    displacements: from.displacementsArray()!.slice(),
    velocities: from.velocitiesArray()!.slice(),
  };
}

export function checkState({ level, stepM, displacements, velocities }: HairState): void {
  checkInteger(level, LevelIndex.high, LevelIndex.ether, "level of a hair state");
  const count = displacements.length;
  if (count === 0 || count % 3 !== 0 || count > kHairStateIntegersMax)
    throw invalid("hair state: not 3 integers a node, or too many");
  if (velocities.length !== 0 && velocities.length !== count) throw invalid("hair state: counts differ");
  if (!(stepM > 0 && stepM <= kHairStateStepMaxM)) throw invalid("hair state: step not in (0, 0.001] m");
}
