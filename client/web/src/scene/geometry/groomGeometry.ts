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

/** The drawn points of the strands, for one tolerance. Strands are in the order of drawing. */
export interface SimplifiedStrands {
  /** largest distance of an omitted point from the drawn line, m */
  readonly toleranceM: number;
  /** two triangles a segment */
  readonly triangles: Uint32Array;
  /** the first n strands have the indices below end[n]; strand count + 1 */
  readonly end: Uint32Array;
}

/** The drawn strands, in the order of drawing. `rest` and `arc` fill rows of kPointRow points, the last with zeros. */
export interface StrandGeometry {
  /** 4 a point: head space, m; delta */
  readonly rest: Float32Array;
  /** 2 a point: length from the root, m; number in its strand, 0 where FFD alone places */
  readonly arc: Float32Array;
  /** the first n strands have the points below pointEnd[n]; strand count + 1 */
  readonly pointEnd: Uint32Array;
  /** two vertices a point, left and right of its ribbon; 4 a vertex, of 255: transmittance from +x -x +y -y */
  readonly sides: Uint8Array;
  /** 4 a vertex, of 255: transmittance from +z -z, fraction of the strand's length, 0 */
  readonly ends: Uint8Array;
  /** the strand's place in the order of drawing */
  readonly strand: Float32Array;
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
  /** the groom's own; `extra`: unit side, left to right; number of the card */
  readonly cards: MeshArrays;
  /** the cards that replace the strands far away */
  readonly farCards: MeshArrays;
  readonly farCardCount: number;
  /** 0: hair is straight over a few centimetres; 1: curls */
  readonly waviness: number;
  /** `extra`: linear RGB, opacity, half of a thread's width (negative on its left; 0: cloth) */
  readonly fabric: MeshArrays;
  /** `rest` has the fifth bone's share in `ends`; `extra`: shares of the first four bones */
  readonly body: MeshArrays;
  /** radius of a ball about the head joint that contains body and hair, m */
  readonly radiusM: number;
}

/** The buffers that a worker transfers instead of copying. */
export function buffersOf(geometry: GroomGeometry): ArrayBuffer[] {
  const buffers: ArrayBuffer[] = [];
  for (const mesh of [geometry.strands, geometry.cards, geometry.farCards, geometry.fabric, geometry.body])
    for (const array of Object.values(mesh)) if (ArrayBuffer.isView(array)) buffers.push(array.buffer as ArrayBuffer);
  for (const list of geometry.strands.lists)
    buffers.push(list.triangles.buffer as ArrayBuffer, list.end.buffer as ArrayBuffer);
  return buffers;
}
