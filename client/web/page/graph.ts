/** Two samples a second for a minute (kFiguresEveryMs of viewer.ts). */
const kSamples = 120;

/** Latency (line, left scale) and bandwidth (area, right scale) of the last minute, on a small canvas. */
export class Graph {
  /** Milliseconds; NaN where the latency is not known, which leaves a gap in the line. */
  readonly #delays: number[] = [];
  /** Kilobytes a second. */
  readonly #rates: number[] = [];

  constructor(private readonly canvas: HTMLCanvasElement) {}

  /** `delayMs` null: not known. Call it twice a second. */
  add(delayMs: number | null, kilobytesPerS: number): void {
    this.#delays.push(delayMs ?? NaN);
    this.#rates.push(kilobytesPerS);
    for (const values of [this.#delays, this.#rates]) if (values.length > kSamples) values.shift();
    this.#draw();
  }

  #draw(): void {
    const { canvas } = this;
    const scale = Math.min(devicePixelRatio, 2);
    const width = Math.round(canvas.clientWidth * scale);
    const height = Math.round(canvas.clientHeight * scale);
    if (width === 0) return;
    if (canvas.width !== width || canvas.height !== height) {
      canvas.width = width;
      canvas.height = height;
    }
    const context = canvas.getContext("2d");
    if (!context) return;
    context.clearRect(0, 0, width, height);
    // The scales end at 50 ms and 10 kB/s at least, so that noise of a quiet connection does not fill the graph. The
    // largest value has 0.9 of the height.
    const delayMax = nice(Math.max(50, ...this.#delays.filter(Number.isFinite)));
    const rateMax = nice(Math.max(10, ...this.#rates));
    const x = (n: number) => width * (1 - (this.#rates.length - 1 - n) / (kSamples - 1));
    context.beginPath();
    context.moveTo(x(0), height);
    for (const [n, rate] of this.#rates.entries()) context.lineTo(x(n), height * (1 - (0.9 * rate) / rateMax));
    context.lineTo(width, height);
    context.fillStyle = "#5f9fbf55";
    context.fill();
    context.beginPath();
    let isDown = false;
    this.#delays.forEach((delay, n) => {
      if (Number.isFinite(delay)) {
        const y = height * (1 - (0.9 * delay) / delayMax);
        if (isDown) context.lineTo(x(n), y);
        else context.moveTo(x(n), y);
      }
      isDown = Number.isFinite(delay);
    });
    context.strokeStyle = "#e0a266";
    context.lineWidth = 1.5 * scale;
    context.stroke();
    context.font = `${10 * scale}px system-ui, sans-serif`;
    context.fillStyle = "#e0a266";
    context.fillText(`${delayMax} ms`, 4 * scale, 12 * scale);
    context.fillStyle = "#8fc4de";
    const label = `${rateMax} kB/s`;
    context.fillText(label, width - context.measureText(label).width - 4 * scale, 12 * scale);
  }
}

/** The smallest of 1, 2, 5 and 10 times a power of ten that is not below `most`: the end of a scale. */
function nice(most: number): number {
  const unit = 10 ** Math.floor(Math.log10(most));
  return [1, 2, 5, 10].map((n) => n * unit).find((n) => n >= most) ?? most;
}
