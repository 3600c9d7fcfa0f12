import { madeStrands } from "./madeGroom";

/** An .obj of the strands as lines, in metres, up +y. */
export function objText(...shape: Parameters<typeof madeStrands>): string {
  const { points, counts } = madeStrands(...shape);
  const lines = Array.from({ length: points.length / 3 }, (_, p) => `v ${points.slice(3 * p, 3 * p + 3).join(" ")}`);
  let first = 1;
  for (const count of counts) {
    lines.push(`l ${Array.from({ length: count }, (_, i) => first + i).join(" ")}`);
    first += count;
  }
  return `${lines.join("\n")}\n`;
}
