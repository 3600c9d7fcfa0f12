import { GIFEncoder, applyPalette, quantize } from "gifenc";

const kVideoTypes = ["video/webm;codecs=vp9", "video/webm;codecs=vp8", "video/webm", "video/mp4"];
const kVideoBitsPerS = 8_000_000;
/** A video of so few bytes has no picture in it. */
const kEmptyBytes = 1000;
/** A browser that draws slowly is given so many times as long until the first picture is in the video. */
const kPatience = 4;
const kPartEveryMs = 250;
const kGifSide = 400;
const kGifEveryMs = 80;

/** A recorded clip of the picture. */
export interface Clip {
  readonly blob: Blob;
  readonly name: string;
}

/** Records the canvas, as WebM (MP4 where the browser writes no WebM). Rejects with one line. */
export async function recordVideo(canvas: HTMLCanvasElement, forMs: number): Promise<Clip> {
  const type =
    typeof MediaRecorder === "undefined" ? "" : kVideoTypes.find((one) => MediaRecorder.isTypeSupported(one));
  if (!type) throw new Error("This browser cannot record video. Choose GIF.");
  const stream = canvas.captureStream(30);
  const recorder = new MediaRecorder(stream, { mimeType: type, videoBitsPerSecond: kVideoBitsPerS });
  const parts: Blob[] = [];
  let bytes = 0;
  recorder.addEventListener("dataavailable", ({ data }) => {
    parts.push(data);
    bytes += data.size;
  });
  const ended = new Promise<void>((done, fail) => {
    recorder.addEventListener("stop", () => done());
    recorder.addEventListener("error", () => fail(new Error("The browser stopped recording.")));
  });
  recorder.start(kPartEveryMs);
  const beganMs = performance.now();
  const timer = setInterval(() => {
    const spanMs = performance.now() - beganMs;
    const isWhole = spanMs > forMs && (bytes > kEmptyBytes || spanMs > kPatience * forMs);
    if (isWhole && recorder.state !== "inactive") recorder.stop();
  }, kPartEveryMs);
  await ended.finally(() => clearInterval(timer));
  for (const track of stream.getTracks()) track.stop();
  const blob = new Blob(parts, { type });
  if (blob.size <= kEmptyBytes) throw new Error("The browser recorded nothing: it draws too slowly. Choose GIF.");
  return { blob, name: `hair.${type.includes("mp4") ? "mp4" : "webm"}` };
}

/** Records the canvas as a small GIF: `takePicture` adds pictures until it is complete. */
export class GifRecording {
  readonly #gif = GIFEncoder();
  readonly #small = document.createElement("canvas");
  readonly #context: CanvasRenderingContext2D;
  #firstMs: number | null = null;
  #lastMs = -Infinity;
  #finish!: (clip: Clip) => void;
  /** Settles when the clip is as long as asked. */
  readonly clip = new Promise<Clip>((done) => (this.#finish = done));
  isComplete = false;

  constructor(
    private readonly canvas: HTMLCanvasElement,
    private readonly forMs: number,
  ) {
    const scale = Math.min(kGifSide / Math.max(canvas.width, canvas.height), 1);
    this.#small.width = Math.round(canvas.width * scale);
    this.#small.height = Math.round(canvas.height * scale);
    this.#context = this.#small.getContext("2d", { willReadFrequently: true })!;
  }

  /** Call it right after drawing: later the canvas may be empty. */
  takePicture(timeMs: number): void {
    if (this.isComplete || timeMs - this.#lastMs < kGifEveryMs) return;
    const delay = this.#firstMs === null ? kGifEveryMs : timeMs - this.#lastMs;
    this.#firstMs ??= timeMs;
    this.#lastMs = timeMs;
    const { width, height } = this.#small;
    this.#context.drawImage(this.canvas, 0, 0, width, height);
    const { data } = this.#context.getImageData(0, 0, width, height);
    const palette = quantize(data, 256);
    this.#gif.writeFrame(applyPalette(data, palette), width, height, { palette, delay });
    if (timeMs - this.#firstMs < this.forMs) return;
    this.isComplete = true;
    this.#gif.finish();
    this.#finish({ blob: new Blob([this.#gif.bytes()], { type: "image/gif" }), name: "hair.gif" });
  }
}

/** Hands the clip to the browser's downloads. */
export function download({ blob, name }: Clip): void {
  const link = document.createElement("a");
  link.href = URL.createObjectURL(blob);
  link.download = name;
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 60_000);
}
