/** Strands, one entry each in every array. */
export interface Strands {
  readonly count: number;
  /** count + 1: strand s has points [begin[s], begin[s + 1]) */
  readonly begin: Uint32Array;
  /** of one real hair, for drawing */
  readonly radiusM: Float32Array;
  /** real hairs that the strand represents */
  readonly hairCount: Float32Array;
  /** lambda_0 of the root blend; 0: none */
  readonly rootLengthM: Float32Array;
  /** index into groupNames */
  readonly group: Uint16Array;
  /** 1: its first point is on the skull */
  readonly rooted: Uint8Array;
}

/** A run of the groom's points, without its end. */
export interface PointRange {
  readonly begin: number;
  readonly end: number;
}

/** A strand drawn as a clump of hair: copies follow it at fixed offsets. */
export interface Clump {
  readonly strand: number;
  readonly copyCount: number;
  readonly radiusM: number;
  readonly tipRadiusM: number;
}

/** Linear RGB, each 0 to 1. */
export type Colour = readonly [number, number, number];

/** A cord or chain: a polyline. */
export interface Thread {
  readonly points: PointRange;
  readonly group: number;
  readonly rooted: boolean;
  readonly rootLengthM: number;
  readonly radiusM: number;
  readonly colour: Colour;
}

/** A lock of hair drawn as one ribbon of textured hair: points left, right, left, right ... from the root. */
export interface HairCard {
  readonly points: PointRange;
  readonly group: number;
  readonly rooted: boolean;
  readonly rootLengthM: number;
  /** real hairs that it represents */
  readonly hairCount: number;
}

/** A lock of many strands as one ribbon of textured hair. */
export interface FarCard {
  /** of `FarCards.points`: left, right, left, right ... from the root */
  readonly points: PointRange;
  /** lambda_0 of the root blend, if rooted; 0: none */
  readonly rootLengthM: number;
  /** strands, and cards of the groom's own, that it replaces */
  readonly strandCount: number;
  readonly group: number;
  readonly rooted: boolean;
}

/** Hair cards that replace a hairstyle's strands and cards far away. They follow the lattice like all points. */
export interface FarCards {
  /** 3 each, head space, m; card by card */
  readonly points: Float32Array;
  readonly cards: readonly FarCard[];
}

/** Woven cloth: a veil, a band, a ribbon. */
export interface Cloth {
  readonly points: PointRange;
  readonly group: number;
  /** 3 a triangle, indices into the groom's points */
  readonly triangles: Uint32Array;
  /** one for each point: the distance along the cloth to where it is pinned, m; empty: not pinned */
  readonly rootDistanceM: Float32Array;
  readonly rootLengthM: number;
  readonly colour: Colour;
  readonly opacity: number;
}

/** Points tied together. */
export interface Knot {
  /** indices into the groom's points */
  readonly points: Uint32Array;
}

/** The material of hair, per real hair where it says so; core/groom/material.hpp explains each value. */
export interface Material {
  readonly axialStiffnessN: number;
  readonly attachmentStiffnessNPerM: number;
  readonly dampingRatio: number;
  readonly linearDensityKgPerM: number;
  readonly airDragNsPerM2: number;
  readonly etherMassRatio: number;
  readonly etherStiffnessPerS2: number;
  readonly etherDampingRatio: number;
  readonly rootLengthM: number;
  readonly thicknessM: number;
  readonly metaballPotentialJ: number;
}

/** The skull and body that a groom was made on, head space at rest, m. */
export interface Body {
  /** 3 a vertex */
  readonly vertices: Float32Array;
  /** 5 a vertex, in the order of `Bone`, of sum 1 */
  readonly boneWeights: Float32Array;
  /** 3 a triangle */
  readonly triangles: Uint32Array;
  /** pivots of the bones, 3 each */
  readonly joints: Float32Array;
  /** no mesh was given: the skull is an ellipsoid */
  readonly fittedFromRoots: boolean;
}

/**
 * The immutable hairstyle in head space (metres), as it lies on the upright head, other things in the hair, and the
 * body under it.
 */
export interface Groom {
  /** the bytes of its file */
  readonly file: Uint8Array;
  readonly name: string;
  readonly groupNames: readonly string[];
  /** 3 each: strand by strand, root first; then those of threads, cards and cloths. All of them follow the lattice. */
  readonly points: Float32Array;
  readonly strands: Strands;
  /** of all hair without its own group material; null in files of version 1, whose hair is normal */
  readonly material: Material | null;
  readonly groupMaterials: readonly { readonly group: number; readonly material: Material }[];
  /**
   * one for each group, or none at all; each has (arc length over root length, delta) pairs; no pairs: 1 - exp(-x^2)
   */
  readonly rootBlends: readonly Float32Array[];
  readonly clumps: readonly Clump[];
  readonly threads: readonly Thread[];
  readonly cards: readonly HairCard[];
  readonly cloths: readonly Cloth[];
  readonly knots: readonly Knot[];
  /** empty in files without them; their points are not in `points` */
  readonly farCards: FarCards;
  readonly body: Body;
}
