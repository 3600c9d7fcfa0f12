import { kPointRow } from "../../generated/constants";
import type { Instance } from "../../module/instance";
import type { GroomGeometry, MeshArrays, StrandGeometry } from "./groomGeometry";

/** `hairnet_part` of client/hairnet.h. */
enum Part {
  strandPoints,
  strandArcs,
  strandEnds,
  strandVertices,
  strandIndices,
  strandIndexEnds,
  cardVertices,
  cardIndices,
  farCardVertices,
  farCardIndices,
  fabricVertices,
  fabricIndices,
  bodyVertices,
  bodyIndices,
}

/** Bytes of a vertex, and where its attributes begin. `extra` follows the others. */
interface VertexLayout {
  readonly size: number;
  readonly restNumbers: number;
  readonly extra: "floats" | "bytes";
  readonly extraSize: number;
}
const kCard: VertexLayout = { size: 48, restNumbers: 4, extra: "floats", extraSize: 4 };
const kFabric: VertexLayout = { size: 52, restNumbers: 4, extra: "floats", extraSize: 5 };
const kBody: VertexLayout = { size: 32, restNumbers: 3, extra: "bytes", extraSize: 4 };
const kStrandVertexBytes = 12;

/**
 * The geometry of the groom in a file, as C++ makes it (client/draw). `isCoarse`: the body and about 500 strands alone;
 * null when the whole takes no longer than a moment. Throws `HairnetError` when the file is damaged.
 */
export function readGeometry(instance: Instance, groom: number, isCoarse: boolean): GroomGeometry | null {
  let geometry: number;
  try {
    geometry = instance.make("hairnet_geometry_make", groom, Number(isCoarse));
  } catch (error) {
    if (isCoarse) return null;
    throw error;
  }
  const bytesOf = (part: Part, list = 0) => instance.bytes("hairnet_geometry_part", geometry, part, list)!;
  const meshOf = (vertices: Part, indices: Part, layout: VertexLayout) =>
    meshArrays(bytesOf(vertices), bytesOf(indices), layout);
  const numbers = instance.struct(20, (at) => instance.call("hairnet_get_geometry_numbers", geometry, at));
  const made: GroomGeometry = {
    strands: strandGeometry(instance, geometry, bytesOf),
    strandCount: numbers.getUint32(0, true),
    farCardCount: numbers.getUint32(4, true),
    strandWidthM: numbers.getFloat32(8, true),
    waviness: numbers.getFloat32(12, true),
    radiusM: numbers.getFloat32(16, true),
    cards: meshOf(Part.cardVertices, Part.cardIndices, kCard),
    farCards: meshOf(Part.farCardVertices, Part.farCardIndices, kCard),
    fabric: meshOf(Part.fabricVertices, Part.fabricIndices, kFabric),
    body: meshOf(Part.bodyVertices, Part.bodyIndices, kBody),
  };
  instance.call("hairnet_geometry_free", geometry);
  return made;
}

function strandGeometry(
  instance: Instance,
  geometry: number,
  bytesOf: (part: Part, list?: number) => Uint8Array,
): StrandGeometry {
  const rest = new Float32Array(bytesOf(Part.strandPoints).buffer);
  const arc = new Float32Array(bytesOf(Part.strandArcs).buffer);
  const vertices = bytesOf(Part.strandVertices);
  const count = vertices.length / kStrandVertexBytes;
  const words = new Uint32Array(vertices.buffer);
  const sides = new Uint32Array(count);
  const ends = new Uint32Array(count);
  const strand = new Uint32Array(count);
  for (let v = 0; v < count; ++v) {
    sides[v] = words[3 * v];
    ends[v] = words[3 * v + 1];
    strand[v] = words[3 * v + 2];
  }
  const listCount = instance.call("hairnet_geometry_lists", geometry, 0, 0);
  const tolerances = instance.struct(4 * listCount, (at) =>
    instance.call("hairnet_geometry_lists", geometry, at, listCount),
  );
  return {
    rest: wholeRows(rest, 4),
    arc: wholeRows(arc, 2),
    pointEnd: new Uint32Array(bytesOf(Part.strandEnds).buffer),
    sides: new Uint8Array(sides.buffer),
    ends: new Uint8Array(ends.buffer),
    strand: new Float32Array(strand.buffer),
    lists: Array.from({ length: listCount }, (_, list) => ({
      toleranceM: tolerances.getFloat32(4 * list, true),
      triangles: new Uint32Array(bytesOf(Part.strandIndices, list).buffer),
      end: new Uint32Array(bytesOf(Part.strandIndexEnds, list).buffer),
    })),
  };
}

/** `numbers` a point; the last row is filled with zeros. */
function wholeRows(points: Float32Array, numbers: number): Float32Array {
  const row = numbers * kPointRow;
  const filled = new Float32Array(Math.ceil(points.length / row) * row);
  filled.set(points);
  return filled;
}

function meshArrays(vertices: Uint8Array, indices: Uint8Array, layout: VertexLayout): MeshArrays {
  const { size, restNumbers, extra, extraSize } = layout;
  const count = vertices.length / size;
  const view = new DataView(vertices.buffer);
  const rest = new Float32Array(4 * count);
  const direction = new Uint16Array(4 * count);
  const sides = new Uint8Array(4 * count);
  const ends = new Uint8Array(4 * count);
  const extras = new Float32Array(extraSize * count);
  for (let v = 0; v < count; ++v) {
    let at = size * v;
    for (let i = 0; i < restNumbers; ++i, at += 4) rest[4 * v + i] = view.getFloat32(at, true);
    for (let i = 0; i < 4; ++i, at += 2) direction[4 * v + i] = view.getUint16(at, true);
    sides.set(vertices.subarray(at, at + 4), 4 * v);
    ends.set(vertices.subarray(at + 4, at + 8), 4 * v);
    at += 8;
    for (let i = 0; i < extraSize; ++i)
      extras[extraSize * v + i] = extra === "floats" ? view.getFloat32(at + 4 * i, true) : vertices[at + i] / 255;
  }
  const triangles = new Uint32Array(indices.buffer);
  return { rest, direction, sides, ends, extra: extras, extraSize, triangles };
}
