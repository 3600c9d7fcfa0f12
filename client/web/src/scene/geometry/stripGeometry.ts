import type { GeometrySource } from "./groomGeometry";
import type { MeshBuilder } from "./meshBuilder";

/** The groom's own strips. */
export function addStrips(source: GeometrySource, mesh: MeshBuilder): void {
  const { groom, blend, rest } = source;
  groom.strips.forEach((strip, number) => {
    const { begin, end } = strip.points;
    addStrip(
      source,
      {
        points: groom.points.subarray(3 * begin, 3 * end),
        directions: rest.direction.subarray(3 * begin, 3 * end),
        blend: blend.subarray(begin, end),
        blendSlope: rest.blendSlope.subarray(begin, end),
      },
      number,
      mesh,
    );
  });
}

/** Left, right, left, right ... from the root. */
interface Edges {
  readonly points: Float32Array;
  readonly directions: Float32Array;
  readonly blend: Float32Array;
  readonly blendSlope: Float32Array;
}

function addStrip({ light }: GeometrySource, edges: Edges, number: number, mesh: MeshBuilder): void {
  const { points, directions } = edges;
  const pairs = edges.blend.length >> 1;
  if (pairs < 2) return;
  const first = mesh.vertexCount;
  const left = new Float32Array(6);
  for (let i = 0; i < 2 * pairs; ++i) {
    const at = 3 * i;
    const from = 3 * (i & ~1);
    const side = [0, 1, 2].map((axis) => points[from + 3 + axis] - points[from + axis]);
    const length = Math.hypot(...side);
    const unit = length > 1e-12 ? side.map((x) => x / length) : [0, 1, 0];
    light.at(points[at], points[at + 1], points[at + 2], left);
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
      (i >> 1) / (pairs - 1),
      i & 1,
    );
    mesh.addExtra(unit[0], unit[1], unit[2], number);
    if (i % 2 === 0 && i + 3 < 2 * pairs) {
      const a = first + i;
      mesh.triangles.push(a, a + 1, a + 2, a + 2, a + 1, a + 3);
    }
  }
}

/** What stands for the strands far away. */
export function addFarStrips(_source: GeometrySource, _mesh: MeshBuilder): void {}
