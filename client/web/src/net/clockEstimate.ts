// Samples closer than this share of the window are merged, which bounds the memory however fast a peer sends.
const kSamplesPerWindow = 256;

/**
 * The offset from a peer's monotonic clock to ours, from the clock in its envelopes: the minimum-delay filter over a
 * sliding window (so that drift is followed). The estimate includes the least one-way delay.
 */
export class ClockEstimate {
  /** times and offsets ascending: the first is the minimum */
  readonly #window: { atNs: number; offsetNs: number }[] = [];

  constructor(private readonly windowNs = 10_000_000_000) {}

  /** `nowNs` does not descend from call to call. */
  observe(peerClockNs: number, nowNs: number): void {
    const window = this.#window;
    const offsetNs = nowNs - peerClockNs;
    while (window.length > 0 && window[window.length - 1].offsetNs >= offsetNs) window.pop();
    const last = window[window.length - 1];
    const merged = last !== undefined && nowNs - last.atNs < this.windowNs / kSamplesPerWindow;
    if (!merged) window.push({ atNs: nowNs, offsetNs });
    while (nowNs - window[0].atNs > this.windowNs) window.shift();
  }

  get known(): boolean {
    return this.#window.length > 0;
  }

  get sampleCount(): number {
    return this.#window.length;
  }

  /** A time on the peer's clock, on ours; as it is while nothing is known. */
  toLocal(peerTimeNs: number): number {
    return this.known ? peerTimeNs + this.#window[0].offsetNs : peerTimeNs;
  }
}
