/** 0 while x is below `low`, 1 above `high`; between them it rises, with a slope of 0 at both ends. */
export function smoothstep(low: number, high: number, x: number): number {
  const t = Math.min(Math.max((x - low) / (high - low), 0), 1);
  return t * t * (3 - 2 * t);
}
