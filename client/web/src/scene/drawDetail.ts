import { kFullHeadPx, kFullStrands, kHeadM, kStrandsMin } from "../generated/constants";

/** The drawing detail of one character's hair; independent of its mechanical level. */
export interface DrawDetail {
  /** of the groom's strands, 0 to 1; the drawn ones are wider in turn */
  strandShare: number;
  /** made beside every strand on the GPU, 0 to 15; a fraction is the opacity of the last one */
  followHairCount: number;
  /** largest distance between a strand's drawn line and its points */
  toleranceM: number;
  /** 1: quadratic FFD; 0: linear; between: a blend */
  quadratic: number;
}

/**
 * `headPx`: a head's height on the screen (0.24 m), in pixels. `quality` multiplies it. The result is continuous in
 * both. Equals client/draw/draw_detail.cpp.
 */
export function detailFor(headPx: number, quality: number, strandCount: number): DrawDetail {
  const px = Math.max(headPx, 0.1) * quality;
  const strands = Math.max(kFullStrands * (px / kFullHeadPx) ** 1.3, kStrandsMin);
  return {
    strandShare: Math.min(strands / Math.max(strandCount, 1), 1),
    followHairCount: 2 * rise(px, 150, 350) + 2 * rise(px, 600, 1200),
    toleranceM: (0.35 * kHeadM) / px,
    quadratic: rise(px, 70, 120),
  };
}

/**
 * The factor by which strands are drawn wider, so that fewer strands and follow hairs cover about the same area.
 */
export function widthScale(detail: DrawDetail): number {
  const drawn = (Math.max(detail.strandShare, 1e-4) * (1 + 0.8 * detail.followHairCount)) / 2.6;
  return Math.min(Math.max(drawn ** -0.8, 0.5), 12);
}

/** 0 up to `from`, 1 from `to` on. */
function rise(x: number, from: number, to: number): number {
  return Math.min(Math.max((x - from) / (to - from), 0), 1);
}
