import { kPointRow } from "../../generated/constants";
import type { Instance } from "../../module/instance";
import type { AttributeArray, Attributes, GroomGeometry, MeshArrays } from "./groomGeometry";

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
  fabricVertices,
  fabricIndices,
  bodyVertices,
  bodyIndices,
}

/**
 * The attributes of a vertex in the module's memory, in their order: the name in the shaders, the type of number, and
 * how many numbers. `hairnet_part` of client/hairnet.h has the same layouts.
 */
type Layout = Readonly<Record<string, readonly [type: keyof typeof kTypes, size: number]>>;
const kTypes = { float: Float32Array, half: Uint16Array, byte: Uint8Array };
/** What all vertices have: six transmittances of light at rest and two further bytes. */
const kLight: Layout = { sides: ["byte", 4], ends: ["byte", 4] };
const kStrand: Layout = { ...kLight, strand: ["float", 1] };
const kOfHair: Layout = { rest: ["float", 4], direction: ["half", 4], ...kLight };
const kCard: Layout = { ...kOfHair, side: ["float", 4] };
const kFabric: Layout = { ...kOfHair, albedo: ["float", 4], cord: ["float", 1] };
const kBody: Layout = { rest: ["float", 3], normal: ["half", 4], ...kLight, shares: ["byte", 4] };

/**
 * The geometry of a groom of the module, as C++ makes it (client/draw). `isCoarse`: the body and about 500 strands
 * alone; null when the whole geometry is made so quickly that no coarse one is needed.
 */
export function readGeometry(instance: Instance, groom: number, isCoarse: boolean): GroomGeometry | null {
  let geometry: number;
  try {
    geometry = instance.make("hairnet_geometry_make", groom, Number(isCoarse));
  } catch (error) {
    if (isCoarse) return null;
    throw error;
  }
  const bytesOf = (part: Part, list = 0) =>
    instance.bytes("hairnet_geometry_part", geometry, part, list)!.buffer as ArrayBuffer;
  const floatsOf = (part: Part) => new Float32Array(bytesOf(part));
  const wordsOf = (part: Part, list?: number) => new Uint32Array(bytesOf(part, list));
  const meshOf = (vertices: Part, indices: Part, layout: Layout): MeshArrays => ({
    attributes: attributesOf(bytesOf(vertices), layout),
    triangles: wordsOf(indices),
  });
  const listCount = instance.call("hairnet_geometry_lists", geometry, 0, 0);
  const tolerances = instance.struct(4 * listCount, (at) =>
    instance.call("hairnet_geometry_lists", geometry, at, listCount),
  );
  const tolerancesM = Array.from({ length: listCount }, (_, list) => tolerances.getFloat32(4 * list, true));
  const numbers = instance.struct(12, (at) => instance.call("hairnet_get_geometry_numbers", geometry, at));
  const made: GroomGeometry = {
    strandCount: numbers.getUint32(0, true),
    strandWidthM: numbers.getFloat32(4, true),
    radiusM: numbers.getFloat32(8, true),
    strands: {
      rest: wholeRows(floatsOf(Part.strandPoints), 4),
      arc: wholeRows(floatsOf(Part.strandArcs), 2),
      pointEnd: wordsOf(Part.strandEnds),
      attributes: attributesOf(bytesOf(Part.strandVertices), kStrand),
      lists: tolerancesM.map((toleranceM, list) => ({
        toleranceM,
        triangles: wordsOf(Part.strandIndices, list),
        end: wordsOf(Part.strandIndexEnds, list),
      })),
    },
    cards: meshOf(Part.cardVertices, Part.cardIndices, kCard),
    fabric: meshOf(Part.fabricVertices, Part.fabricIndices, kFabric),
    body: meshOf(Part.bodyVertices, Part.bodyIndices, kBody),
  };
  instance.call("hairnet_geometry_free", geometry);
  return made;
}

/** Copies points of `numbers` numbers each, and fills the last row of kPointRow points with zeros. */
function wholeRows(points: Float32Array, numbers: number): Float32Array<ArrayBuffer> {
  const row = numbers * kPointRow;
  const filled = new Float32Array(Math.ceil(points.length / row) * row);
  filled.set(points);
  return filled;
}

/** An array for each attribute of the vertices: WebGL's buffers, as three.js has them, have numbers of one type. */
function attributesOf(vertices: ArrayBuffer, layout: Layout): Attributes {
  const vertexBytes = Object.values(layout).reduce(
    (sum, [type, size]) => sum + size * kTypes[type].BYTES_PER_ELEMENT,
    0,
  );
  const count = vertices.byteLength / vertexBytes;
  const made: Record<string, AttributeArray> = {};
  let first = 0;
  for (const [name, [type, size]] of Object.entries(layout)) {
    const from = new kTypes[type](vertices);
    const array = new kTypes[type](size * count);
    // The module has vertex after vertex. `stride` and `begin` count numbers of this type, not bytes.
    const stride = vertexBytes / from.BYTES_PER_ELEMENT;
    const begin = first / from.BYTES_PER_ELEMENT;
    for (let v = 0; v < count; ++v) for (let i = 0; i < size; ++i) array[size * v + i] = from[stride * v + begin + i];
    made[name] = { array, size };
    first += size * from.BYTES_PER_ELEMENT;
  }
  return made;
}
