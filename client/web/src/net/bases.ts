import { displacementsOf } from "../hair/basis";
import { HairnetError } from "../hair/hairnetError";
import { ErrorClass, kStepsM } from "../hair/level";
import type { LevelGeometry } from "../hair/lattice";
import type { Pose } from "../hair/pose";
import { decodeBasis, type HairBasis } from "./basisFile";
import { CoefficientCode } from "./codec/coefficientCode";
import { decodeCoefficientFrame } from "./codec/coefficientFrame";
import type { FrameIntegers } from "./codec/frameIntegers";
import type { GroomFetched } from "./events";
import type { GroomHash } from "./groomHash";
import type { GroomBasis } from "./messages";

/** The error class of nodes that come from coefficients. */
export const kBasisErrorClass = ErrorClass.quarterMm;

// Between two requests for one basis: a server that sends too much already refuses.
const kAskAgainNs = 2e9;

interface KnownBasis extends HairBasis {
  readonly code: CoefficientCode;
  /** room for one frame */
  readonly displacements: Float32Array;
}

interface Entry {
  readonly file: GroomHash;
  basis: KnownBasis | null;
  isUnusable: boolean;
  askedNs: number;
}

/** The bases of grooms, as the server announced them and as they have arrived; they turn coefficients into nodes. */
export class Bases {
  /** by groom */
  readonly #entries = new Map<GroomHash, Entry>();

  /**
   * The server announces the same basis again over each connection. Another one replaces the basis that is here: its
   * coefficients mean other shapes.
   */
  announce({ groom, basis }: GroomBasis): void {
    if (this.#entries.get(groom)?.file === basis) return;
    this.#entries.set(groom, { file: basis, basis: null, isUnusable: false, askedNs: -Infinity });
  }

  /**
   * The file to ask for, once a frame needs it; null while the basis is here, cannot be used, was not announced, or was
   * asked for a moment ago.
   */
  wanted(groom: GroomHash, nowNs: number): GroomHash | null {
    const entry = this.#entries.get(groom);
    if (!entry || entry.basis || entry.isUnusable || nowNs - entry.askedNs < kAskAgainNs) return null;
    entry.askedNs = nowNs;
    return entry.file;
  }

  /** The groom whose basis the file of this hash is; null: of none. */
  groomOf(file: GroomHash): GroomHash | null {
    for (const [groom, entry] of this.#entries) if (entry.file === file) return groom;
    return null;
  }

  /** Takes the file of an announced basis. Returns why it cannot be used; empty: it can. */
  take(groom: GroomHash, { bytes, fault }: GroomFetched): string {
    if (!bytes) return fault;
    const entry = this.#entries.get(groom)!;
    try {
      const { geometry, basis } = decodeBasis(bytes);
      const displacements = new Float32Array(3 * basis.nodeCount);
      entry.basis = { geometry, basis, code: new CoefficientCode(basis.deviationM), displacements };
      return "";
    } catch (error) {
      if (!(error instanceof HairnetError)) throw error;
      entry.isUnusable = true;
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
    const known = this.#entries.get(groom)?.basis;
    const coded = decodeCoefficientFrame(content, known?.code ?? null);
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

  /** The session is lost. Returns the files that were announced. */
  clear(): GroomHash[] {
    const files = [...this.#entries.values()].map((entry) => entry.file);
    this.#entries.clear();
    return files;
  }
}
