import type { Groom } from "../../hair/groom";
import { restTangents, type RestTangents } from "../../hair/restTangents";
import { rootBlend } from "../../hair/rootBlend";
import { addBody } from "./bodyGeometry";
import { drawnStrandCount } from "./clumpStrands";
import { addFabric } from "./fabricGeometry";
import { OcclusionGrid } from "./occlusionGrid";
import { makeStrands } from "./strandGeometry";
import { addFarCards, addCards } from "./cardGeometry";
import { MeshBuilder, type MeshArrays } from "./meshBuilder";

/** Which points of the strands are drawn. Strands stand in the order of drawing. */
export interface SimplifiedStrands {
  /** no point left out is further from the line, m */
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
  /** two vertices a point, left and right of its ribbon; 4 a vertex, of 255: light left from +x -x +y -y */
  readonly sides: Uint8Array;
  /** 4 a vertex, of 255: light left from +z -z, fraction of the strand's length, 0 */
  readonly ends: Uint8Array;
  /** the strand's place in the order of drawing */
  readonly strand: Float32Array;
  /** from all points to few */
  readonly lists: readonly SimplifiedStrands[];
}

/**
 * What the shaders take of a groom, at rest in head space: made once, for all its characters (client/shaders). Plain
 * arrays, so that a worker can make it; client/render/groom_geometry.hpp is the same in C++.
 */
export interface GroomGeometry {
  readonly strands: StrandGeometry;
  /** that are drawn: clumps' copies among them */
  readonly strandCount: number;
  /** at the root, when all strands and two follow hairs each are drawn */
  readonly strandWidthM: number;
  /** the groom's own; `extra`: unit side, left to right; number of the card */
  readonly cards: MeshArrays;
  /** in place of its strands */
  readonly farCards: MeshArrays;
  readonly farCardCount: number;
  /** 0: hairs keep to the course of their lock; 1: curls */
  readonly waviness: number;
  /** `extra`: linear RGB, opacity, half of a thread's width (negative on its left; 0: cloth) */
  readonly fabric: MeshArrays;
  /** `rest` has the fifth bone's share in `ends`; `extra`: shares of the first four bones */
  readonly body: MeshArrays;
  /** of a ball about the head joint that holds all of it, m */
  readonly radiusM: number;
}

/** What the parts of a geometry are made of. */
export interface GeometrySource {
  readonly groom: Groom;
  readonly light: OcclusionGrid;
  /** delta of every groom point */
  readonly blend: Float32Array;
  /** how hair goes on at each */
  readonly rest: RestTangents;
}

/** `groom` is sound, as decoding leaves it. */
export function makeGroomGeometry(groom: Groom): GroomGeometry {
  const strandCount = drawnStrandCount(groom);
  const strandWidthM = widthFor(strandCount);
  const copies = 3; // a strand and its follow hairs
  const drawnPerStrand = strandCount / Math.max(1, groom.strands.count);
  const light = new OcclusionGrid(groom, strandWidthM * copies * drawnPerStrand);
  const blend = rootBlend(groom);
  const source: GeometrySource = { groom, light, blend, rest: restTangents(groom, blend) };
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

/** What a worker hands over rather than copies. */
export function buffersOf(geometry: GroomGeometry): ArrayBuffer[] {
  const buffers: ArrayBuffer[] = [];
  for (const mesh of [geometry.strands, geometry.cards, geometry.farCards, geometry.fabric, geometry.body])
    for (const array of Object.values(mesh)) if (ArrayBuffer.isView(array)) buffers.push(array.buffer as ArrayBuffer);
  for (const list of geometry.strands.lists) buffers.push(list.triangles.buffer as ArrayBuffer, list.end.buffer as ArrayBuffer);
  return buffers;
}

/** Fewer strands are drawn wider, so that a head looks covered at any density. */
function widthFor(strandCount: number): number {
  return 4e-4 * Math.min(Math.max(Math.sqrt(10_000 / Math.max(1, strandCount)), 0.6), 4);
}

/**
 * Measures curliness: compares the length of a hair with the straight distance over a few centimetres. The result is
 * the sine of the mean angle between the hair and that straight line, scaled to 0 to 1.
 */
function wavinessOf({ strands, points }: Groom): number {
  const courseM = 0.04;
  const bentByTheHead = 0.2;
  const curls = 0.35;
  let length = 0;
  let course = 0;
  const distance = (a: number, b: number) =>
    Math.hypot(points[3 * a] - points[3 * b], points[3 * a + 1] - points[3 * b + 1], points[3 * a + 2] - points[3 * b + 2]);
  for (let s = 0; s < strands.count; ++s) {
    const end = strands.begin[s + 1];
    let piece = 0;
    let from = strands.begin[s];
    for (let i = from + 1; i < end; ++i) {
      piece += distance(i, i - 1);
      if (piece < courseM && i + 1 < end) continue;
      length += piece;
      course += distance(i, from);
      piece = 0;
      from = i;
    }
  }
  const straight = length > 0 ? Math.min(course / length, 1) : 1;
  return Math.min(Math.max((Math.sqrt(1 - straight * straight) - bentByTheHead) / curls, 0), 1);
}

function radiusOf(groom: Groom): number {
  let squared = 0;
  for (const points of [groom.points, groom.body.vertices]) {
    for (let i = 0; i + 2 < points.length; i += 3)
      squared = Math.max(squared, points[i] ** 2 + points[i + 1] ** 2 + points[i + 2] ** 2);
  }
  return Math.sqrt(squared);
}
