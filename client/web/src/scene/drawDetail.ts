import { client } from "../module/client";
import type { Instance } from "../module/instance";
import { At, kDrawnBytes } from "./drawn";

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
 * both. The client must have started, as after `connect` and `Groom.load`.
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

/** Of the `hairnet_drawn` at that place. */
export function readDetail(module: Instance, drawn: number, detail: DrawDetail): void {
  const memory = module.floatMemory();
  const at = (drawn + At.detail) / 4;
  detail.strandShare = memory[at];
  detail.followHairCount = memory[at + 1];
  detail.toleranceM = memory[at + 2];
  detail.quadratic = memory[at + 3];
}
