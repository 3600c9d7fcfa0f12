import { displacementsOf } from "../hair/basis";
import { HairnetError } from "../hair/hairnetError";
import { ErrorClass, kStepsM } from "../hair/level";
import type { LevelGeometry } from "../hair/lattice";
import type { Pose } from "../hair/pose";
import { decodeBasis, type HairBasis } from "./basisFile";
import { CoefficientCode } from "./codec/coefficientCode";
import { decodeFrameCode } from "./codec/frameCode";
import type { FrameIntegers } from "./codec/frameIntegers";
import type { GroomFetched } from "./events";
import type { GroomHash } from "./groomHash";
import type { GroomBasis } from "./messages";

/** The error class of nodes that come from coefficients. */
export const kBasisErrorClass = ErrorClass.quarterMm;

interface KnownBasis extends HairBasis {
  readonly code: CoefficientCode;
  /** room for one frame */
  readonly displacements: Float32Array;
}

/** The bases of grooms, as the server announced them and as they have arrived; they turn coefficients into nodes. */
export class Bases {
  /** hashes of the files, by groom */
  readonly #announced = new Map<GroomHash, GroomHash>();
  readonly #known = new Map<GroomHash, KnownBasis>();

  /** Whether its file is to be fetched: the same basis is announced again over each connection. */
  announce({ groom, basis }: GroomBasis): boolean {
    if (this.#announced.get(groom) === basis) return false;
    this.#announced.set(groom, basis);
    return true;
  }

  /** The groom whose basis the file of this hash is; null: of none. */
  groomOf(file: GroomHash): GroomHash | null {
    for (const [groom, basis] of this.#announced) if (basis === file) return groom;
    return null;
  }

  /** Returns why the basis cannot be used; empty: it can. */
  take(groom: GroomHash, { bytes, fault }: GroomFetched): string {
    if (!bytes) return fault;
    try {
      const { geometry, basis } = decodeBasis(bytes);
      const displacements = new Float32Array(3 * basis.nodeCount);
      this.#known.set(groom, { geometry, basis, code: new CoefficientCode(basis.deviationM), displacements });
      return "";
    } catch (error) {
      if (!(error instanceof HairnetError)) throw error;
      return error.message;
    }
  }

  /**
   * Decodes a frame of coefficients. Returns the geometry of its nodes; null while the basis is on its way: the frame
   * has a pose alone; undefined when it cannot be decoded. `isRigid`: the hair has no nodes at all.
   */
  decode(
    groom: GroomHash,
    content: Uint8Array,
    isRigid: boolean,
    integers: FrameIntegers,
    pose: Pose,
  ): LevelGeometry | null | undefined {
    const known = this.#known.get(groom);
    const coded = decodeFrameCode(content, known?.code ?? null);
    if (!coded) return undefined;
    pose.set(coded.pose);
    if (!known || isRigid) {
      integers.resize(0, 0);
      return null;
    }
    displacementsOf(known.basis, coded.coefficients, known.displacements);
    integers.resize(known.displacements.length, 0);
    const perStep = 1 / kStepsM[kBasisErrorClass];
    for (let i = 0; i < known.displacements.length; ++i)
      integers.nodes[i] = Math.max(-32767, Math.min(32767, Math.round(known.displacements[i] * perStep)));
    return known.geometry;
  }

  clear(): void {
    this.#announced.clear();
    this.#known.clear();
  }
}
