import type { Pose } from "../../src/hair/pose";
import type { Skin } from "../../src/hair/skin";
import { vectors } from "./vectors";

interface SkinVector {
  skin: { bone: number; origin: number[]; cellM: number; dims: [number, number, number]; bytes: number[] }[];
  thicknessM: number;
  pose: number[];
  rest: number[];
  blend: number[];
  points: number[];
  pushed: number[];
  nodes: number[];
}

/** Points around a skin, and where C++ pushes them. */
export function skinVector() {
  const { skin, thicknessM, pose, rest, blend, points, pushed, nodes } = vectors<SkinVector>("skin.json");
  return {
    skin: skin.map(({ bone, origin, cellM, dims, bytes }) => ({
      bone,
      origin: Float32Array.from(origin),
      cellM,
      dims,
      bytes: Uint8Array.from(bytes),
    })) as Skin,
    thicknessM,
    pose: Float64Array.from(pose) as Pose,
    rest: Float32Array.from(rest),
    blend: Float32Array.from(blend),
    points: Float32Array.from(points),
    pushed: Float32Array.from(pushed),
    nodes: Uint8Array.from(nodes),
  };
}
