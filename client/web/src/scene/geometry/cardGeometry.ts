import { farCardTangents, type RestTangents } from "../../hair/restTangents";
import { farCardBlend } from "../../hair/rootBlend";
import type { GeometrySource } from "./geometrySource";
import type { MeshBuilder } from "./meshBuilder";

/** Adds the groom's own cards. */
export function addCards(source: GeometrySource, mesh: MeshBuilder): void {
  const { groom, blend, rest } = source;
  for (const [number, card] of groom.cards.entries())
    addCard(source, edgesOf(groom.points, blend, rest, card.points), number, mesh);
}

/** Adds the cards that replace the strands far away. */
export function addFarCards(source: GeometrySource, mesh: MeshBuilder): void {
  const { farCards } = source.groom;
  const blend = farCardBlend(source.groom);
  const rest = farCardTangents(farCards, blend);
  for (const [number, card] of farCards.cards.entries())
    addCard(source, edgesOf(farCards.points, blend, rest, card.points), number, mesh);
}

/** Adds one card, whose points are left, right, left, right ... from the root. */
interface Edges {
  readonly points: Float32Array;
  readonly directions: Float32Array;
  readonly blend: Float32Array;
  readonly blendSlope: Float32Array;
}

function edgesOf(
  points: Float32Array,
  blend: Float32Array,
  rest: RestTangents,
  { begin, end }: { readonly begin: number; readonly end: number },
): Edges {
  return {
    points: points.subarray(3 * begin, 3 * end),
    directions: rest.direction.subarray(3 * begin, 3 * end),
    blend: blend.subarray(begin, end),
    blendSlope: rest.blendSlope.subarray(begin, end),
  };
}

function addCard({ occlusion }: GeometrySource, edges: Edges, number: number, mesh: MeshBuilder): void {
  const { points, directions } = edges;
  const pairs = edges.blend.length >> 1;
  if (pairs < 2) return;
  const first = mesh.vertexCount;
  const left = new Float32Array(6);
  const lengths = lengthsOf(points, pairs);
  const length = Math.max(lengths[pairs - 1], 1e-6);
  for (let i = 0; i < 2 * pairs; ++i) {
    const at = 3 * i;
    const from = 3 * (i & ~1);
    const side = [0, 1, 2].map((axis) => points[from + 3 + axis] - points[from + axis]);
    const width = Math.hypot(...side);
    const unit = width > 1e-12 ? side.map((x) => x / width) : [0, 1, 0];
    occlusion.at(points[at], points[at + 1], points[at + 2], left);
    mesh.add(
      points[at],
      points[at + 1],
      points[at + 2],
      edges.blend[i],
      directions[at],
      directions[at + 1],
      directions[at + 2],
      edges.blendSlope[i],
      left,
      lengths[i >> 1] / length,
      i & 1,
    );
    mesh.addExtra(unit[0], unit[1], unit[2], number);
    if (i % 2 === 0 && i + 3 < 2 * pairs) {
      const a = first + i;
      mesh.triangles.push(a, a + 1, a + 2, a + 2, a + 1, a + 3);
    }
  }
}

/** The arc length along the middle of the card, for each pair of points. */
function lengthsOf(points: Float32Array, pairs: number): Float32Array {
  const lengths = new Float32Array(pairs);
  for (let i = 1; i < pairs; ++i) {
    const at = 6 * i;
    const step = [0, 1, 2].map(
      (axis) => points[at + axis] + points[at + 3 + axis] - points[at - 6 + axis] - points[at - 3 + axis],
    );
    lengths[i] = lengths[i - 1] + 0.5 * Math.hypot(...step);
  }
  return lengths;
}
