import type { Groom } from "../../hair/groom";

/** Fewer strands, which are drawn wider, would not cover a head (`widthFor`). */
const kStrands = 500;
const kStrandsMin = 2000;

/**
 * The body and about 500 strands of a groom, for the time until the geometry of the whole groom is made; null when
 * that takes no longer than a moment. Strands are alone in it: all other parts point into the points that it leaves out.
 */
export function coarseGroom(groom: Groom): Groom | null {
  const { strands, points } = groom;
  if (strands.count < kStrandsMin) return null;
  const step = Math.floor(strands.count / kStrands);
  const kept = Uint32Array.from({ length: Math.ceil(strands.count / step) }, (_, i) => step * i);
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
