import type { HairBasis } from "../hair/basis";
import { decodeBasis } from "./basisFile";
import { CoefficientCode } from "./codec/coefficientCode";
import { GroomFiles } from "./groomFiles";

/** The data for decoding frames of a groom. Immutable. */
export interface KnownBasis extends HairBasis {
  readonly code: CoefficientCode;
}

export function newBases(): GroomFiles<KnownBasis> {
  return new GroomFiles((file) => {
    const hair = decodeBasis(file);
    return { ...hair, code: new CoefficientCode(hair.basis.deviationM) };
  });
}
