import * as flatbuffers from "flatbuffers";
import type * as g from "../hair/groom";
import { HairnetError } from "../hair/hairnetError";
import { validateGroom } from "../hair/validateGroom";
import { layouts } from "./generated/layout";
import * as fb from "./generated/messages";
import {
  decodeBoneWeights,
  decodeIndices,
  decodePoints,
  decodeTriangles,
  pointRuns,
  strandOffsets,
} from "./groomNumbers";
import { isPacked, kPackedGroom, unpack } from "./packing";
import { kGroomBytesMax } from "./messages";
import { decodeText } from "./text";
import { hasIdentifier, verifyBuffer } from "./verify";

const kGroomVersion = 3;
const kUtf8 = flatbuffers.Encoding.UTF8_BYTES;

/**
 * The hairstyle of a groom file (`GroomFetched`, or what `hairnet-groom` writes), checked all through: offsets, counts,
 * ranges and that numbers are finite. Nothing of it lies in `file`. Throws `HairnetError` and nothing else.
 */
export function decodeGroom(file: Uint8Array): g.Groom {
  if (file.length > kGroomBytesMax)
    throw new HairnetError("too_large", `${file.length} bytes, more than the limit of ${kGroomBytesMax}`);
  if (!isPacked(file, kPackedGroom) && !hasIdentifier(file, "HNGR"))
    throw invalid("not a .groom file (it does not begin as one)");
  const table = isPacked(file, kPackedGroom) ? unpack(file, kPackedGroom) : file;
  const aligned = table.byteOffset % 8 === 0 ? table : table.slice();
  verifyBuffer(aligned, "HNGR", "Groom", layouts);
  const root = fb.Groom.getSizePrefixedRootAsGroom(new flatbuffers.ByteBuffer(aligned));
  const version = root.version();
  if (version < 1 || version > kGroomVersion)
    throw invalid(`groom file of version ${version}, not 1 to ${kGroomVersion}`);
  const groom = readGroom(root, file);
  validateGroom(groom);
  return groom;
}

function invalid(why: string): HairnetError {
  return new HairnetError("invalid", why);
}

function readGroom(from: fb.Groom, file: Uint8Array): g.Groom {
  const strands = readStrands(from);
  const nextPoints = pointCounter(strands.begin.length > 0 ? strands.begin[strands.begin.length - 1] : 0);
  const owners = {
    threads: list(from.threadsLength(), (i) => readThread(from.threads(i)!, nextPoints)),
    cards: list(from.cardsLength(), (i) => readCard(from.cards(i)!, nextPoints)),
    cloths: readCloths(from, nextPoints),
  };
  return {
    file,
    name: textOf(from.name(kUtf8), "groom's name"),
    groupNames: readGroupNames(from),
    points:
      from.version() < 3
        ? from.pointsArray()!.slice()
        : decodePoints(
            {
              weights: from.pointWeightsArray(),
              references: from.pointReferencesArray(),
              planes: from.pointPlanesArray(),
            },
            pointRuns(strands.begin, owners),
          ),
    strands,
    ...readMaterials(from),
    rootBlends: readRootBlends(from),
    clumps: list(from.clumpsLength(), (i) => readClump(from.clumps(i)!)),
    ...owners,
    knots: readKnots(from),
    farCards: readFarCards(from),
    body: readBody(from),
  };
}

function list<T>(count: number, each: (index: number) => T): T[] {
  if (count > kListMax) throw invalid(`${count} clumps, threads, cards, cloths or knots, more than ${kListMax}`);
  return Array.from({ length: count }, (_, index) => each(index));
}
/** Of the most there may be of anything that becomes an object each: clumps, one a strand. */
const kListMax = 200_000;

function textOf(bytes: string | Uint8Array | null, name: string): string {
  const text = decodeText(bytes as Uint8Array);
  if (text === null) throw invalid(`${name} is not text`);
  return text;
}

function readGroupNames(from: fb.Groom): string[] {
  const count = from.groupNamesLength();
  if (count > 256) throw invalid(`${count} groups, more than the limit of 256`);
  return list(count, (i) => textOf(from.groupNames(i, kUtf8), "a group's name"));
}

function readStrands(from: fb.Groom): g.Strands {
  const count = from.strandsLength();
  const strands = {
    count,
    begin:
      from.version() < 3
        ? from.strandBeginArray()!.slice()
        : strandOffsets(from.strandPointCountsArray() ?? new Uint32Array(0)),
    radiusM: new Float32Array(count),
    hairCount: new Float32Array(count),
    rootLengthM: new Float32Array(count),
    group: new Uint16Array(count),
    rooted: new Uint8Array(count),
  };
  const each = new fb.StrandProperties();
  for (let s = 0; s < count; ++s) {
    from.strands(s, each);
    strands.radiusM[s] = each.radiusM();
    strands.hairCount[s] = each.hairCount();
    strands.rootLengthM[s] = each.rootLengthM();
    strands.group[s] = each.group();
    strands.rooted[s] = each.rooted() ? 1 : 0;
  }
  return strands;
}

function readMaterials(from: fb.Groom): Pick<g.Groom, "material" | "groupMaterials"> {
  if (from.version() < 2) return { material: null, groupMaterials: [] };
  const base = from.material();
  if (!base) throw invalid("materials are missing");
  if (from.groupMaterialsLength() > 256) throw invalid("more materials than a groom may have groups");
  return {
    material: readMaterial(base),
    groupMaterials: list(from.groupMaterialsLength(), (i) => {
      const each = from.groupMaterials(i)!;
      return { group: each.group(), material: readMaterial(each.material()!) };
    }),
  };
}

function readMaterial(from: fb.Material): g.Material {
  return {
    axialStiffnessN: from.axialStiffnessN(),
    attachmentStiffnessNPerM: from.attachmentStiffnessNPerM(),
    dampingRatio: from.dampingRatio(),
    linearDensityKgPerM: from.linearDensityKgPerM(),
    airDragNsPerM2: from.airDragNsPerM2(),
    etherMassRatio: from.etherMassRatio(),
    etherStiffnessPerS2: from.etherStiffnessPerS2(),
    etherDampingRatio: from.etherDampingRatio(),
    rootLengthM: from.rootLengthM(),
    thicknessM: from.thicknessM(),
    metaballPotentialJ: from.metaballPotentialJ(),
  };
}

/** Hands out a vector's numbers, piece by piece. */
function pieces<T extends Float32Array | Uint32Array>(all: T, name: string) {
  let next = 0;
  return {
    take(count: number): T {
      if (count > all.length - next) throw invalid(`fewer ${name} than counted`);
      next += count;
      return all.slice(next - count, next) as T;
    },
    finish(): void {
      if (next !== all.length) throw invalid(`more ${name} than counted`);
    },
  };
}

function readRootBlends(from: fb.Groom): Float32Array[] {
  const points = pieces(from.rootBlendPointsArray() ?? new Float32Array(0), "root blend points");
  const counts = from.rootBlendCountsArray() ?? new Uint16Array(0);
  if (counts.length > 256) throw invalid("root blends are neither none nor one a group");
  const blends = Array.from(counts, (count) => points.take(2 * count));
  points.finish();
  return blends;
}

/** Hands out the points after the strands'; whether they are there is checked with the whole groom. */
function pointCounter(first: number): (count: number) => g.PointRange {
  let next = first;
  return (count) => {
    const begin = next;
    next += count;
    return { begin, end: next };
  };
}

function colourOf(from: fb.Vec3): g.Colour {
  return [from.x(), from.y(), from.z()];
}

function readClump(from: fb.Clump): g.Clump {
  return {
    strand: from.strand(),
    copyCount: from.copyCount(),
    radiusM: from.radiusM(),
    tipRadiusM: from.tipRadiusM(),
  };
}

function readThread(from: fb.Thread, nextPoints: (count: number) => g.PointRange): g.Thread {
  return {
    points: nextPoints(from.pointCount()),
    group: from.group(),
    rooted: from.rooted(),
    rootLengthM: from.rootLengthM(),
    radiusM: from.radiusM(),
    colour: colourOf(from.colour()!),
  };
}

function readCard(from: fb.HairCard, nextPoints: (count: number) => g.PointRange): g.HairCard {
  const properties = from.properties()!;
  return {
    points: nextPoints(from.pointCount()),
    group: properties.group(),
    rooted: properties.rooted(),
    rootLengthM: properties.rootLengthM(),
    hairCount: properties.hairCount(),
  };
}

function readIndices(from: fb.Groom, plain: Uint32Array | null, planes: Uint8Array | null): Uint32Array {
  return from.version() < 3 ? (plain ?? new Uint32Array(0)) : decodeIndices(planes);
}

function readCloths(from: fb.Groom, nextPoints: (count: number) => g.PointRange): g.Cloth[] {
  const triangles = pieces(
    readIndices(from, from.clothTrianglesArray(), from.clothTrianglePlanesArray()),
    "cloth triangles",
  );
  const distances = pieces(from.clothRootDistancesArray() ?? new Float32Array(0), "distances on cloth");
  const cloths = list(from.clothsLength(), (i) => {
    const cloth = from.cloths(i)!;
    return {
      points: nextPoints(cloth.pointCount()),
      group: cloth.group(),
      triangles: triangles.take(3 * cloth.triangleCount()),
      rootDistanceM: distances.take(cloth.pinned() ? cloth.pointCount() : 0),
      rootLengthM: cloth.rootLengthM(),
      colour: colourOf(cloth.colour()!),
      opacity: cloth.opacity(),
    };
  });
  triangles.finish();
  distances.finish();
  return cloths;
}

function readKnots(from: fb.Groom): g.Knot[] {
  const points = pieces(readIndices(from, from.knotPointsArray(), from.knotPointPlanesArray()), "tied points");
  const knots = list(from.knotsLength(), (i) => ({ points: points.take(from.knots(i)!.pointCount()) }));
  points.finish();
  return knots;
}

function readFarCards(from: fb.Groom): g.FarCards {
  const nextPoints = pointCounter(0);
  const cards = list(from.farCardsLength(), (i) => {
    const card = from.farCards(i)!;
    return {
      points: nextPoints(card.pointCount()),
      rootLengthM: card.rootLengthM(),
      strandCount: card.strandCount(),
      group: card.group(),
      rooted: card.rooted(),
    };
  });
  const points =
    from.version() < 3
      ? (from.farCardPointsArray()?.slice() ?? new Float32Array(0))
      : decodePoints(
          {
            weights: from.farCardWeightsArray(),
            references: from.farCardReferencesArray(),
            planes: from.farCardPlanesArray(),
          },
          cards.map((card) => ({ ...card.points, stride: 2 })),
        );
  return { points, cards };
}

function readBody(from: fb.Groom): g.Body {
  const joints = from.joints()!;
  return {
    ...(from.version() < 3 ? readMesh(from) : decodeMesh(from)),
    joints: Float32Array.from(
      [joints.head(), joints.neck(), joints.leftShoulder(), joints.rightShoulder(), joints.upperTrunk()].flatMap(
        (joint) => [joint!.x(), joint!.y(), joint!.z()],
      ),
    ),
    fittedFromRoots: from.fittedFromRoots(),
  };
}

function readMesh(from: fb.Groom): Pick<g.Body, "vertices" | "boneWeights" | "triangles"> {
  return {
    vertices: from.verticesArray()!.slice(),
    boneWeights: from.boneWeightsArray()!.slice(),
    triangles: from.trianglesArray()!.slice(),
  };
}

function decodeMesh(from: fb.Groom): Pick<g.Body, "vertices" | "boneWeights" | "triangles"> {
  const planes = from.vertexPlanesArray();
  const wholeBody = { begin: 0, end: Math.floor((planes?.length ?? 0) / 9), stride: 1 };
  return {
    vertices: decodePoints({ weights: null, references: null, planes }, [wholeBody]),
    boneWeights: decodeBoneWeights(from.boneWeightPlanesArray()),
    triangles: decodeTriangles(from.trianglePlanesArray()),
  };
}
