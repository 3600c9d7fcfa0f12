import { kBentByTheHead, kCopies, kCourseM, kCurls, kWidthCount, kWidthM } from "../../generated/constants";
import type { Groom } from "../../hair/groom";
import { restTangents } from "../../hair/restTangents";
import { rootBlend } from "../../hair/rootBlend";
import { addBody } from "./bodyGeometry";
import { addCards, addFarCards } from "./cardGeometry";
import { drawnStrandCount } from "./clumpStrands";
import { addFabric } from "./fabricGeometry";
import type { GeometrySource } from "./geometrySource";
import type { GroomGeometry } from "./groomGeometry";
import { MeshBuilder } from "./meshBuilder";
import { OcclusionGrid } from "./occlusionGrid";
import { makeStrands } from "./strandGeometry";

/** `groom` must be valid, as the decoder returns it. */
export function makeGroomGeometry(groom: Groom): GroomGeometry {
  const strandCount = drawnStrandCount(groom);
  const strandWidthM = widthFor(strandCount);
  const drawnPerStrand = strandCount / Math.max(1, groom.strands.count);
  const occlusion = new OcclusionGrid(groom, strandWidthM * kCopies * drawnPerStrand);
  const blend = rootBlend(groom);
  const source: GeometrySource = { groom, occlusion, blend, rest: restTangents(groom, blend) };
  const cards = new MeshBuilder(4);
  const farCards = new MeshBuilder(4);
  const fabric = new MeshBuilder(5);
  const body = new MeshBuilder(4);
  addCards(source, cards);
  addFarCards(source, farCards);
  addFabric(source, fabric);
  addBody(source, body);
  return {
    strands: makeStrands(source),
    strandCount,
    strandWidthM,
    cards: cards.take(),
    farCards: farCards.take(),
    farCardCount: groom.farCards.cards.length,
    fabric: fabric.take(),
    body: body.take(),
    waviness: wavinessOf(groom),
    radiusM: radiusOf(groom),
  };
}

/** Fewer strands are drawn wider, so that a head looks covered at any density. */
function widthFor(strandCount: number): number {
  return kWidthM * Math.min(Math.max(Math.sqrt(kWidthCount / Math.max(1, strandCount)), 0.6), 4);
}

/**
 * Measures curliness: compares the length of a hair with the straight distance over a few centimetres. The result is
 * the sine of the mean angle between the hair and that straight line, scaled to 0 to 1.
 */
function wavinessOf({ strands, points }: Groom): number {
  let length = 0;
  let course = 0;
  const distance = (a: number, b: number) =>
    Math.hypot(
      points[3 * a] - points[3 * b],
      points[3 * a + 1] - points[3 * b + 1],
      points[3 * a + 2] - points[3 * b + 2],
    );
  for (let s = 0; s < strands.count; ++s) {
    const end = strands.begin[s + 1];
    let piece = 0;
    let from = strands.begin[s];
    for (let i = from + 1; i < end; ++i) {
      piece += distance(i, i - 1);
      if (piece < kCourseM && i + 1 < end) continue;
      length += piece;
      course += distance(i, from);
      piece = 0;
      from = i;
    }
  }
  const straight = length > 0 ? Math.min(course / length, 1) : 1;
  return Math.min(Math.max((Math.sqrt(1 - straight * straight) - kBentByTheHead) / kCurls, 0), 1);
}

function radiusOf(groom: Groom): number {
  let squared = 0;
  for (const points of [groom.points, groom.farCards.points, groom.body.vertices]) {
    for (let i = 0; i + 2 < points.length; i += 3)
      squared = Math.max(squared, points[i] ** 2 + points[i + 1] ** 2 + points[i + 2] ** 2);
  }
  return Math.sqrt(squared);
}
