import { kGroomLimits } from "../generated/limits";
import type { Cloth, Colour, Groom, PointRange } from "./groom";
import { HairnetError } from "./hairnetError";
import { kBoneCount } from "./pose";

const kRootBlendPointsMax = 64;

/**
 * Throws `HairnetError` unless the groom is valid: consistent offsets, finite and bounded numbers, existing groups,
 * weights and triangles. The server checks the ranges of materials. Empty and single-point strands are valid.
 */
export function validateGroom(groom: Groom): void {
  checkStrands(groom);
  checkMaterials(groom);
  checkCount("threads", groom.threads.length, kGroomLimits.fabricCountMax);
  checkCount("cards", groom.cards.length, kGroomLimits.fabricCountMax);
  checkCount("cloths", groom.cloths.length, kGroomLimits.fabricCountMax);
  checkCount("knots", groom.knots.length, kGroomLimits.fabricCountMax);
  checkRootBlends(groom);
  checkClumps(groom);
  checkPointOwners(groom);
  checkKnots(groom);
  checkFarCards(groom);
  checkBody(groom);
}

function refuse(why: string): never {
  throw new HairnetError("invalid", why);
}

function checkCount(name: string, count: number, most: number): void {
  if (count > most) refuse(`${count} ${name}, more than the limit of ${most}`);
}

/** Written so that NaN fails. */
function checkRange(what: string, value: number, least: number, most: number): void {
  if (!(value >= least && value <= most)) refuse(`${what} is ${value}, not in [${least}, ${most}]`);
}

function checkGroup(what: string, group: number, groom: Groom): void {
  if (group >= groom.groupNames.length) refuse(`${what}: its group does not exist`);
}

function checkCoordinates(what: string, coordinates: Float32Array): void {
  if (coordinates.length % 3 !== 0) refuse(`${what}s are not 3 numbers each`);
  for (let i = 0; i < coordinates.length; ++i) {
    if (!(Math.abs(coordinates[i]) <= kGroomLimits.coordinateMaxM))
      refuse(`${what} ${Math.floor(i / 3)}: not finite, or more than ${kGroomLimits.coordinateMaxM} m from the head`);
  }
}

function checkStrands(groom: Groom): void {
  const { strands, points } = groom;
  checkCount("strands", strands.count, kGroomLimits.strandCountMax);
  checkCount("points", points.length / 3, kGroomLimits.pointCountMax);
  checkCount("groups", groom.groupNames.length, kGroomLimits.groupCountMax);
  if (strands.begin.length !== strands.count + 1 || strands.begin[0] !== 0)
    refuse("strand offsets do not cover the points");
  for (let s = 0; s < strands.count; ++s) {
    if (strands.begin[s] > strands.begin[s + 1]) refuse(`strand ${s}: offsets descend`);
    checkGroup(`strand ${s}`, strands.group[s], groom);
    if (!(strands.radiusM[s] > 0)) refuse(`strand ${s}: radius is not above 0`);
    checkRange(`strand ${s}: radius (m)`, strands.radiusM[s], 0, 0.01);
    checkHairCount(`strand ${s}`, strands.hairCount[s]);
    checkRange(`strand ${s}: root length (m)`, strands.rootLengthM[s], 0, 10);
  }
  if (strands.begin[strands.count] > points.length / 3) refuse("strand offsets go beyond the points");
  checkCoordinates("point", points);
}

function checkMaterials(groom: Groom): void {
  const materials = groom.groupMaterials.map((each) => each.material);
  if (groom.material) materials.push(groom.material);
  for (const material of materials) {
    if (!Object.values(material).every(Number.isFinite)) refuse("a material's numbers are not finite");
  }
  for (const each of groom.groupMaterials) checkGroup("material", each.group, groom);
}

function checkHairCount(what: string, hairCount: number): void {
  if (!(hairCount > 0 && hairCount <= 1e6)) refuse(`${what}: hair count not in (0, 1e6]`);
}

function checkRootBlends(groom: Groom): void {
  const { rootBlends, groupNames } = groom;
  if (rootBlends.length !== 0 && rootBlends.length !== groupNames.length)
    refuse("root blends are neither none nor one a group");
  rootBlends.forEach((curve, group) => {
    if (curve.length > 2 * kRootBlendPointsMax)
      refuse(`group ${group}: root blend has more than ${kRootBlendPointsMax} points`);
    let x = 0;
    let y = 0;
    for (let i = 0; i < curve.length; i += 2) {
      if (!(curve[i] > x && curve[i] <= 1e4))
        refuse(`group ${group}: root blend's arc lengths do not rise from 0, or end beyond 10000`);
      if (!(curve[i + 1] >= y && curve[i + 1] <= 1)) refuse(`group ${group}: root blend falls, or leaves [0, 1]`);
      x = curve[i];
      y = curve[i + 1];
    }
  });
}

function checkClumps(groom: Groom): void {
  const { strands, clumps } = groom;
  checkCount("clumps", clumps.length, strands.count);
  let drawnPoints = groom.points.length / 3;
  clumps.forEach((clump, c) => {
    if (clump.strand >= strands.count) refuse(`clump ${c}: its strand does not exist`);
    checkCount(`copies of clump ${c}`, clump.copyCount, kGroomLimits.copyCountMax);
    checkRange(`clump ${c}: radius (m)`, clump.radiusM, 0, 0.1);
    checkRange(`clump ${c}: radius at the tip (m)`, clump.tipRadiusM, 0, 0.1);
    drawnPoints += clump.copyCount * (strands.begin[clump.strand + 1] - strands.begin[clump.strand]);
  });
  checkCount("points with the clumps'", drawnPoints, kGroomLimits.pointCountMax);
}

/** The points of threads, cards and cloths follow those of the strands, one after the other. */
function checkPointOwners(groom: Groom): void {
  const pointCount = groom.points.length / 3;
  let next = groom.strands.begin[groom.strands.count];
  const take = (what: string, range: PointRange, least: number, unit: number): void => {
    if (range.begin !== next || range.end < range.begin || range.end > pointCount)
      refuse(`${what}: its points do not follow those before it`);
    next = range.end;
    const count = range.end - range.begin;
    if (count < least || count % unit !== 0) refuse(`${what}: too few points, or one without its partner`);
  };
  groom.threads.forEach((thread, i) => {
    take(`thread ${i}`, thread.points, 2, 1);
    checkGroup(`thread ${i}`, thread.group, groom);
    checkColour(`thread ${i}`, thread.colour);
    checkRange(`thread ${i}: root length (m)`, thread.rootLengthM, 0, 10);
    checkRange(`thread ${i}: radius (m)`, thread.radiusM, Math.fround(1e-6), Math.fround(0.05));
  });
  groom.cards.forEach((card, i) => {
    take(`card ${i}`, card.points, 4, 2);
    checkGroup(`card ${i}`, card.group, groom);
    checkHairCount(`card ${i}`, card.hairCount);
    checkRange(`card ${i}: root length (m)`, card.rootLengthM, 0, 10);
  });
  groom.cloths.forEach((cloth, i) => {
    take(`cloth ${i}`, cloth.points, 3, 1);
    checkCloth(`cloth ${i}`, cloth, groom);
  });
  if (next !== pointCount) refuse("strands, threads, cards and cloths do not cover the points");
}

function checkColour(what: string, colour: Colour): void {
  if (!colour.every((part) => part >= 0 && part <= 1)) refuse(`${what}: colour is not in [0, 1]`);
}

function checkCloth(what: string, cloth: Cloth, groom: Groom): void {
  checkGroup(what, cloth.group, groom);
  checkColour(what, cloth.colour);
  const { triangles, points, rootDistanceM } = cloth;
  checkCount(`triangles of ${what}`, triangles.length / 3, 2 * kGroomLimits.vertexCountMax);
  for (let t = 0; t < triangles.length; t += 3) {
    const [a, b, c] = [triangles[t], triangles[t + 1], triangles[t + 2]];
    if (Math.min(a, b, c) < points.begin || Math.max(a, b, c) >= points.end)
      refuse(`${what}: triangle ${t / 3}: a point is not the cloth's own`);
    if (a === b || b === c || c === a) refuse(`${what}: triangle ${t / 3}: a corner comes twice`);
  }
  if (rootDistanceM.length !== 0 && rootDistanceM.length !== points.end - points.begin)
    refuse(`${what}: distances from the pins are neither none nor one a point`);
  for (const distance of rootDistanceM) checkRange(`${what}: a distance from the pins (m)`, distance, 0, 100);
  checkRange(`${what}: root length (m)`, cloth.rootLengthM, 0, 10);
  checkRange(`${what}: opacity`, cloth.opacity, 0, 1);
}

function checkKnots(groom: Groom): void {
  let tied = 0;
  groom.knots.forEach((knot, k) => {
    if (knot.points.length < 2) refuse(`knot ${k}: ties fewer than two points`);
    for (const point of knot.points) {
      if (point >= groom.points.length / 3) refuse(`knot ${k}: a tied point does not exist`);
    }
    tied += knot.points.length;
  });
  checkCount("tied points", tied, kGroomLimits.pointCountMax);
}

function checkFarCards(groom: Groom): void {
  const { points, cards } = groom.farCards;
  checkCount("far cards", cards.length, kGroomLimits.farCardCountMax);
  let next = 0;
  cards.forEach((card, i) => {
    const { begin, end } = card.points;
    if (begin !== next || end < begin || end > points.length / 3)
      refuse(`far card ${i}: its points do not follow those before it`);
    next = end;
    const count = end - begin;
    if (count < 4 || count % 2 !== 0) refuse(`far card ${i}: too few points, or one without its partner`);
    checkCount(`pairs of points of far card ${i}`, count / 2, kGroomLimits.farCardPairCountMax);
    checkGroup(`far card ${i}`, card.group, groom);
    checkRange(`far card ${i}: root length (m)`, card.rootLengthM, 0, 10);
    if (card.strandCount < 1 || card.strandCount > groom.strands.count + groom.cards.length)
      refuse(`far card ${i}: stands for no strands, or more than there are`);
  });
  if (next !== points.length / 3) refuse("far cards do not cover their points");
  checkCoordinates("far cards' point", points);
}

function checkBody(groom: Groom): void {
  const { vertices, boneWeights, triangles, joints } = groom.body;
  if (vertices.length % 3 !== 0 || triangles.length % 3 !== 0 || boneWeights.length % kBoneCount !== 0)
    refuse("body: vertices or triangles are not 3 numbers each, or bone weights not 5");
  const vertexCount = vertices.length / 3;
  checkCount("body vertices", vertexCount, kGroomLimits.vertexCountMax);
  checkCount("body triangles", triangles.length / 3, 2 * kGroomLimits.vertexCountMax);
  if (boneWeights.length / kBoneCount !== vertexCount) refuse("bone weights are not one entry a body vertex");
  checkCoordinates("body vertex", vertices);
  for (let v = 0; v < vertexCount; ++v) {
    let sum = 0;
    for (let bone = 0; bone < kBoneCount; ++bone) {
      const weight = boneWeights[kBoneCount * v + bone];
      checkRange(`body vertex ${v}: a bone weight`, weight, 0, 1.001);
      sum += weight;
    }
    if (!(Math.abs(sum - 1) <= 1e-3)) refuse(`body vertex ${v}: bone weights do not sum to 1`);
  }
  for (let t = 0; t < triangles.length; ++t) {
    if (triangles[t] >= vertexCount) refuse(`body triangle ${Math.floor(t / 3)}: a vertex does not exist`);
  }
  checkCoordinates("joint", joints);
}
