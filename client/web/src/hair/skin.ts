import type { Bone } from "./pose";

/** The part of the skin that moves with one bone, as a grid of distances from it. */
export interface SkinGrid {
  readonly bone: Bone;
  /** The place of the first node, head space at rest, m. */
  readonly origin: readonly [number, number, number];
  /** The distance of two neighbouring nodes. */
  readonly cellM: number;
  /** The count of nodes on each axis; x is fastest, then y. */
  readonly dims: readonly [number, number, number];
  /** The number of the first node among all nodes of the skin. */
  readonly first: number;
}

/** The skin to keep hair out of, as client/shaders/skin_push.glsl reads it. */
export interface Skin {
  readonly grids: readonly SkinGrid[];
  /** 4 bytes a node: the distance from the skin, and the direction out of it. */
  readonly nodes: Uint8Array;
  /** The thickness of the hair. */
  readonly thicknessM: number;
}
