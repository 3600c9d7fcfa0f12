import type { Groom } from "../../hair/groom";

const kShare = 10;
const kStrandsMin = 2000;

/**
 * The body and every tenth strand of a groom, for the time until the geometry of the whole groom is made; null when
 * that takes no longer than a moment. Strands are alone in it: all other parts point into the points that it leaves out.
 */
export function coarseGroom(groom: Groom): Groom | null {
  const { strands, points } = groom;
  if (strands.count < kStrandsMin) return null;
  const kept = Uint32Array.from({ length: Math.ceil(strands.count / kShare) }, (_, i) => kShare * i);
  const begin = new Uint32Array(kept.length + 1);
  kept.forEach((s, i) => {
    begin[i + 1] = begin[i] + strands.begin[s + 1] - strands.begin[s];
  });
  const keptPoints = new Float32Array(3 * begin[kept.length]);
  for (const [i, s] of kept.entries())
    keptPoints.set(points.subarray(3 * strands.begin[s], 3 * strands.begin[s + 1]), 3 * begin[i]);
  return {
    ...groom,
    points: keptPoints,
    strands: {
      count: kept.length,
      begin,
      radiusM: Float32Array.from(kept, (s) => strands.radiusM[s]),
      hairCount: Float32Array.from(kept, (s) => strands.hairCount[s]),
      rootLengthM: Float32Array.from(kept, (s) => strands.rootLengthM[s]),
      group: Uint16Array.from(kept, (s) => strands.group[s]),
      rooted: Uint8Array.from(kept, (s) => strands.rooted[s]),
    },
    clumps: [],
    threads: [],
    cards: [],
    cloths: [],
    knots: [],
  };
}
