/**
 * The numbers of one attribute of vertices: floats, halves (16 bits of IEEE 754), or bytes, which are shares of 255.
 */
export interface AttributeArray {
  readonly array: Float32Array<ArrayBuffer> | Uint16Array<ArrayBuffer> | Uint8Array<ArrayBuffer>;
  /** How many numbers a vertex has. */
  readonly size: number;
}

/** Attributes by their names in the shaders of client/shaders. */
export type Attributes = Readonly<Record<string, AttributeArray>>;

/** A mesh: its vertices' attributes, and three indices of vertices for each triangle. */
export interface MeshArrays {
  readonly attributes: Attributes;
  readonly triangles: Uint32Array<ArrayBuffer>;
}

/** The drawn points of the strands, for one tolerance. Strands are in the order of drawing. */
export interface SimplifiedStrands {
  /** The largest distance of an omitted point from the drawn line, m. */
  readonly toleranceM: number;
  /** The indices of vertices: two triangles for each drawn segment. */
  readonly triangles: Uint32Array<ArrayBuffer>;
  /** The first n strands have the indices before end[n]; strand count + 1 numbers. */
  readonly end: Uint32Array<ArrayBuffer>;
}

/** The drawn strands, in the order of drawing. `rest` and `arc` fill rows of kPointRow points, the last with zeros. */
export interface StrandGeometry {
  /** 4 numbers a point: x y z in head space, m, and its share of the lattice's motion. */
  readonly rest: Float32Array<ArrayBuffer>;
  /** 2 numbers a point: the length from the root, m, and its number in the strand, or 0 where FFD alone places it. */
  readonly arc: Float32Array<ArrayBuffer>;
  /** The first n strands have the points before pointEnd[n]; strand count + 1 numbers. */
  readonly pointEnd: Uint32Array<ArrayBuffer>;
  /** The attributes of two vertices a point, left and right in the ribbon that is drawn. */
  readonly attributes: Attributes;
  /** Lists with more and more omitted points, beginning with all points. */
  readonly lists: readonly SimplifiedStrands[];
}

/**
 * The data of a groom for the shaders (client/shaders), at rest in head space; made once for all its characters. Plain
 * arrays, so that a worker can hand it over; client/draw/groom_geometry.hpp makes it.
 */
export interface GroomGeometry {
  readonly strands: StrandGeometry;
  /** The number of drawn strands, with the copies of clumps. */
  readonly strandCount: number;
  /** The width of a strand at its root, m, when all strands are drawn with two follow hairs each. */
  readonly strandWidthM: number;
  readonly cards: MeshArrays;
  readonly fabric: MeshArrays;
  readonly body: MeshArrays;
  /** The radius of a ball about the head joint that contains body and hair at rest, m. */
  readonly radiusM: number;
}

/** All its memory: a worker transfers it instead of copying. */
export function buffersOf({ strands, cards, fabric, body }: GroomGeometry): ArrayBuffer[] {
  const meshes = [strands, cards, fabric, body];
  return [
    ...meshes.flatMap(({ attributes }) => Object.values(attributes).map(({ array }) => array)),
    ...[cards, fabric, body].map(({ triangles }) => triangles),
    ...[strands.rest, strands.arc, strands.pointEnd],
    ...strands.lists.flatMap(({ triangles, end }) => [triangles, end]),
  ].map(({ buffer }) => buffer);
}
