import { madeStrands } from "./madeGroom";

/** The text of an .obj file that has each strand of `madeStrands` as a polyline (`l`), in metres, with +y upwards. */
export function objText(...shape: Parameters<typeof madeStrands>): string {
  const { points, counts } = madeStrands(...shape);
  const lines = Array.from({ length: points.length / 3 }, (_, p) => `v ${points.slice(3 * p, 3 * p + 3).join(" ")}`);
  // An .obj file counts its points from 1.
  let first = 1;
  for (const count of counts) {
    lines.push(`l ${Array.from({ length: count }, (_, i) => first + i).join(" ")}`);
    first += count;
  }
  return `${lines.join("\n")}\n`;
}
