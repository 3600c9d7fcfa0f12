const kBoundMinNs = 100_000_000;
const kBoundMaxNs = 5_000_000_000;

/**
 * How long to wait before the next attempt to connect: at random between nothing and as long as the connection has been
 * away (full jitter). So clients of a server that restarts do not come back as one, and they ask ever less often.
 * `random`: from 0 up to 1.
 */
export function backoffNs(awayNs: number, random: () => number): number {
  return Math.floor(random() * Math.min(Math.max(awayNs, kBoundMinNs), kBoundMaxNs));
}
