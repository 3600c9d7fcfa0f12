import { growingBytes, growingFloats, growingHalves, growingIndices } from "./growing";
import { toHalf } from "./half";
import type { Transmittance } from "./occlusionGrid";

/** Vertices as the shaders of client/shaders read them: location 0 rest, 1 direction, 2 sides, 3 ends, 4 ... extra. */
export interface MeshArrays {
  /** 4 a vertex: head space, m; delta */
  readonly rest: Float32Array;
  /** 4 IEEE halves a vertex: a direction; d delta / ds, 1/m, or a value of the part */
  readonly direction: Uint16Array;
  /** 4 a vertex, of 255: transmittance from +x -x +y -y */
  readonly sides: Uint8Array;
  /** 4 a vertex, of 255: from +z -z, and two values of the part */
  readonly ends: Uint8Array;
  /** `extraSize` a vertex */
  readonly extra: Float32Array;
  readonly extraSize: number;
  readonly triangles: Uint32Array;
}

/** Collects the vertices and triangles of one part of a groom's geometry. */
export class MeshBuilder {
  readonly triangles = growingIndices();
  #vertexCount = 0;
  readonly #rest = growingFloats();
  readonly #direction = growingHalves();
  readonly #sides = growingBytes();
  readonly #ends = growingBytes();
  readonly #extra = growingFloats();

  constructor(private readonly extraSize: number) {}

  get vertexCount(): number {
    return this.#vertexCount;
  }

  /** `third` and `fourth` of `ends` are 0 to 1. */
  add(
    x: number,
    y: number,
    z: number,
    delta: number,
    dx: number,
    dy: number,
    dz: number,
    slope: number,
    left: Transmittance,
    third: number,
    fourth: number,
  ): void {
    this.#vertexCount += 1;
    let at = this.#rest.length;
    const rest = this.#rest.extend(4);
    rest[at] = x;
    rest[at + 1] = y;
    rest[at + 2] = z;
    rest[at + 3] = delta;
    at = this.#direction.length;
    const direction = this.#direction.extend(4);
    direction[at] = toHalf(dx);
    direction[at + 1] = toHalf(dy);
    direction[at + 2] = toHalf(dz);
    direction[at + 3] = toHalf(slope);
    at = this.#sides.length;
    const sides = this.#sides.extend(4);
    for (let side = 0; side < 4; ++side) sides[at + side] = toByte(left[side]);
    at = this.#ends.length;
    const ends = this.#ends.extend(4);
    ends[at] = toByte(left[4]);
    ends[at + 1] = toByte(left[5]);
    ends[at + 2] = toByte(third);
    ends[at + 3] = toByte(fourth);
  }

  /** The index of the last vertex. */
  addExtra(...numbers: number[]): void {
    this.#extra.push(...numbers);
  }

  take(): MeshArrays {
    return {
      rest: this.#rest.take(),
      direction: this.#direction.take(),
      sides: this.#sides.take(),
      ends: this.#ends.take(),
      extra: this.#extra.take(),
      extraSize: this.extraSize,
      triangles: this.triangles.take(),
    };
  }
}

export function toByte(x: number): number {
  return Math.round(255 * Math.min(Math.max(x, 0), 1));
}
