import type { BitReader } from "./bits";
import { unfold32 } from "./golomb";

// The coefficients of a basis as bits, the most important first (schema/codec/README.md, Poses and coefficients).

const kFinestStepM = 2 ** -14;
const kStepBits = 3;
const kCalmBits = 3;
const kZerosMax = 16;
/** Of a coefficient that comes whole, after the most zeros. */
const kWholeBits = 20;
const kParameterMin = -8;
const kParameterMax = 16;

/** How many bits a coefficient is likely to need, from the deviations of a basis. Immutable. */
export class CoefficientCode {
  /** At step and calm 0; negative: less than a bit. */
  readonly #parameters: Int8Array;

  /** Of each coefficient, m, above 0. */
  constructor(deviationM: Float32Array) {
    this.#parameters = Int8Array.from(deviationM, parameterOf);
  }

  get modeCount(): number {
    return this.#parameters.length;
  }

  /** The bits of coefficient k that come as they are, when hair moves 2^-calm of what is usual. */
  parameter(k: number, step: number, calm: number): number {
    return Math.max(this.#parameters[k] - step - calm, 0);
  }
}

function parameterOf(deviationM: number): number {
  const size = (1.375 * deviationM) / kFinestStepM;
  let parameter = kParameterMin;
  while (parameter < kParameterMax && size >= 2 ** (parameter + 1)) ++parameter;
  return parameter;
}

/**
 * Reads as many coefficients as there are whole ones, m, and returns their number. `out` has room for all modes. Any bits
 * are valid.
 */
export function decodeCoefficients(code: CoefficientCode, reader: BitReader, out: Float32Array): number {
  const step = reader.take(kStepBits);
  const calm = reader.take(kCalmBits);
  const stepM = kFinestStepM * 2 ** step;
  const { modeCount } = code;
  for (let k = 0; k < modeCount; ++k) {
    const parameter = code.parameter(k, step, calm);
    const zeros = reader.peekZeros(kZerosMax);
    reader.skip(zeros + 1);
    const z = zeros < kZerosMax ? (zeros << parameter) | reader.take(parameter) : reader.take(kWholeBits);
    if (reader.isBeyondEnd()) return k;
    out[k] = stepM * unfold32(z);
  }
  return modeCount;
}
