/** The numbers of one attribute: floats, IEEE halves, or bytes, of 255. */
export interface AttributeArray {
  readonly array: Float32Array<ArrayBuffer> | Uint16Array<ArrayBuffer> | Uint8Array<ArrayBuffer>;
  /** numbers a vertex */
  readonly size: number;
}

/** By their names in the shaders of client/shaders. */
export type Attributes = Readonly<Record<string, AttributeArray>>;

export interface MeshArrays {
  readonly attributes: Attributes;
  readonly triangles: Uint32Array<ArrayBuffer>;
}

/** The drawn points of the strands, for one tolerance. Strands are in the order of drawing. */
export interface SimplifiedStrands {
  /** largest distance of an omitted point from the drawn line, m */
  readonly toleranceM: number;
  /** two triangles a segment */
  readonly triangles: Uint32Array<ArrayBuffer>;
  /** the first n strands have the indices below end[n]; strand count + 1 */
  readonly end: Uint32Array<ArrayBuffer>;
}

/** The drawn strands, in the order of drawing. `rest` and `arc` fill rows of kPointRow points, the last with zeros. */
export interface StrandGeometry {
  /** 4 a point: head space, m; delta */
  readonly rest: Float32Array<ArrayBuffer>;
  /** 2 a point: length from the root, m; number in its strand, 0 where FFD alone places */
  readonly arc: Float32Array<ArrayBuffer>;
  /** the first n strands have the points below pointEnd[n]; strand count + 1 */
  readonly pointEnd: Uint32Array<ArrayBuffer>;
  /** of two vertices a point, left and right of its ribbon */
  readonly attributes: Attributes;
  /** from all points to few */
  readonly lists: readonly SimplifiedStrands[];
}

/**
 * The data of a groom for the shaders (client/shaders), at rest in head space; made once for all its characters. Plain
 * arrays, so that a worker can hand it over; client/draw/groom_geometry.hpp makes it.
 */
export interface GroomGeometry {
  readonly strands: StrandGeometry;
  /** number of drawn strands, with the copies of clumps */
  readonly strandCount: number;
  /** the width at the root, m, when all strands are drawn with two follow hairs each */
  readonly strandWidthM: number;
  readonly cards: MeshArrays;
  readonly fabric: MeshArrays;
  readonly body: MeshArrays;
  /** radius of a ball about the head joint that contains body and hair, m */
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
