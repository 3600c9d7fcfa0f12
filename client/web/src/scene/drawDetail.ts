import { client } from "../module/client";
import type { Instance } from "../module/instance";
import { At, kDrawnBytes } from "./drawn";

/** The drawing detail of one character's hair; independent of its mechanical level. */
export interface DrawDetail {
  /** The share of the groom's strands that is drawn, 0 to 1. With a smaller share the drawn strands are wider. */
  strandShare: number;
  /** How many hairs the GPU draws beside every strand, 0 to 15. A fraction is the opacity of the last one. */
  followHairCount: number;
  /** The largest distance of a point from the line of its strand that is drawn without the point. */
  toleranceM: number;
  /** How the lattice deforms hair: 1 is quadratic FFD, 0 is linear FFD, and numbers between are a blend. */
  quadratic: number;
}

/**
 * The detail for a head that is `headPx` pixels high on the screen (kHeadM, 0.24 m). `quality` multiplies this height.
 * The result is continuous in both. The client must have started, as after `connect` and `Groom.load`.
 */
export function detailFor(headPx: number, quality: number, strandCount: number): DrawDetail {
  const module = client();
  const drawn = module.struct(kDrawnBytes, (at) => {
    module.view().setFloat32(at + At.headPx, headPx, true);
    module.view().setUint32(at + At.strandCount, strandCount, true);
    module.call("hairnet_choose_details", at, 1, quality);
  });
  const detail = { strandShare: 0, followHairCount: 0, toleranceM: 0, quadratic: 0 };
  readDetail(module, drawn.byteOffset, detail);
  return detail;
}

/** Reads the detail of the `hairnet_drawn` at the address `drawn` into `detail`. */
export function readDetail(module: Instance, drawn: number, detail: DrawDetail): void {
  const memory = module.floatMemory();
  const at = (drawn + At.detail) / 4;
  detail.strandShare = memory[at];
  detail.followHairCount = memory[at + 1];
  detail.toleranceM = memory[at + 2];
  detail.quadratic = memory[at + 3];
}
