import type { Bone } from "./pose";

/** The grid of one bone's skin. */
export interface SkinGrid {
  readonly bone: Bone;
  /** of its first node, head space at rest, m */
  readonly origin: readonly [number, number, number];
  /** between two nodes */
  readonly cellM: number;
  /** nodes an axis; x is fastest, then y */
  readonly dims: readonly [number, number, number];
  /** number of its first node among all nodes */
  readonly first: number;
}

/** The skin to keep hair out of, as client/shaders/skin_push.glsl reads it. */
export interface Skin {
  readonly grids: readonly SkinGrid[];
  /** 4 bytes a node: the distance, and the way out */
  readonly nodes: Uint8Array;
  /** of the hair */
  readonly thicknessM: number;
}
