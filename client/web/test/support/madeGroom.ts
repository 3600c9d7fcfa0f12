import type { Groom } from "../../src/hair/groom";

/**
 * Makes `strands` hairs of `points` points each in head space. They begin on a circle of 9 cm about the +Y axis, 16 cm
 * above the head joint, and hang down for 30 cm. Each swings out and in by `waveM`, m, with a phase of its own.
 */
export function madeStrands(
  strands = 40,
  points = 12,
  waveM = 0.004,
): { points: Float32Array<ArrayBuffer>; counts: Uint32Array<ArrayBuffer> } {
  const xyz = new Float32Array(3 * strands * points);
  for (let s = 0; s < strands; ++s) {
    const turn = (2 * Math.PI * s) / strands;
    for (let i = 0; i < points; ++i) {
      const down = (0.3 * i) / (points - 1);
      // 40 rad/m are about two waves over the length of 0.3 m.
      const out = 0.09 + waveM * Math.sin(40 * down + s);
      xyz.set([out * Math.sin(turn), 0.16 - down, out * Math.cos(turn)], 3 * (s * points + i));
    }
  }
  return { points: xyz, counts: new Uint32Array(strands).fill(points) };
}

/** Stands for a `Groom` without a module. It has the points of `madeStrands`, and an egg of a head as its body. */
export function madeGroom(...shape: Parameters<typeof madeStrands>): Pick<Groom, "points" | "body"> {
  const { vertices, triangles } = egg();
  // Each vertex has a weight for each of the five bones, and the head, the first of them, has all of it.
  const boneWeights = Float32Array.from({ length: (5 * vertices.length) / 3 }, (_, i) => (i % 5 === 0 ? 1 : 0));
  return { points: madeStrands(...shape).points, body: { vertices, triangles, boneWeights } };
}

/** An ellipsoid of about a head's size: half axes of 0.08, 0.12 and 0.1 m about (0, 0.08, 0.02) in head space. */
function egg(): { vertices: Float32Array; triangles: Uint32Array } {
  const rings = 24;
  const turns = 24;
  const vertices: number[] = [];
  const triangles: number[] = [];
  for (let i = 0; i <= rings; ++i)
    for (let j = 0; j <= turns; ++j) {
      const polar = (Math.PI * i) / rings;
      const turn = (2 * Math.PI * j) / turns;
      vertices.push(
        0.08 * Math.sin(polar) * Math.sin(turn),
        0.08 + 0.12 * Math.cos(polar),
        0.02 + 0.1 * Math.sin(polar) * Math.cos(turn),
      );
      if (i === rings || j === turns) continue;
      const a = i * (turns + 1) + j;
      triangles.push(a, a + turns + 1, a + 1, a + 1, a + turns + 1, a + turns + 2);
    }
  return { vertices: Float32Array.from(vertices), triangles: Uint32Array.from(triangles) };
}
