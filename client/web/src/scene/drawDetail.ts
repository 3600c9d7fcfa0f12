import { kFullHeadPx, kFullStrands, kHeadM, kStrandsMin } from "../generated/constants";

/** How finely one character's hair is drawn; chosen apart from its mechanical level. */
export interface DrawDetail {
  /** of the groom's strands, 0 to 1; what is drawn is wider in turn */
  strandShare: number;
  /** made beside every strand on the GPU, 0 to 15; a fraction is the last one's opacity */
  followHairCount: number;
  /** how far a strand's drawn line may be from its points */
  toleranceM: number;
  /** 1: quadratic FFD; 0: linear; between: so much of each */
  quadratic: number;
  /** 0: strands; 1: cards; between: both, faded */
  cards: number;
}

/**
 * `headPx`: a head's height on the screen (0.24 m), in pixels. `quality` multiplies it. Continuous in both.
 * `waviness`: of the groom; cards pass for straight hair at a larger size than for curls. Equals
 * client/render/draw_detail.cpp.
 */
export function detailFor(headPx: number, quality: number, strandCount: number, waviness: number): DrawDetail {
  const px = Math.max(headPx, 0.1) * quality;
  const strands = Math.max(kFullStrands * (px / kFullHeadPx) ** 1.3, kStrandsMin);
  return {
    strandShare: Math.min(strands / Math.max(strandCount, 1), 1),
    followHairCount: 2 * rise(px, 150, 350) + 2 * rise(px, 600, 1200),
    toleranceM: (0.35 * kHeadM) / px,
    quadratic: rise(px, 70, 120),
    cards: 1 - rise(px, 75 - 30 * waviness, 110 - 40 * waviness),
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
