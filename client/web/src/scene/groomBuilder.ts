import { HairnetError, messageOf } from "../module/hairnetError";
import { hairModule } from "../module/moduleFile";
import { Instance } from "../module/instance";
import type { GroomGeometry } from "./geometry/groomGeometry";
import { readGeometry } from "./geometry/readGeometry";
import GroomWorker from "./groomWorker?worker&inline";

/** What the worker answers (groomWorker.ts): exactly one of the three, for the request `id`. */
type Answer = { id: number; coarse?: GroomGeometry; geometry?: GroomGeometry; error?: string };
/**
 * The whole geometry is asked for after this many pictures have shown the coarse one. Making it at once would slow down
 * the first of these pictures.
 */
const kCoarsePictures = 3;

/** A groom that is being built; the functions are those of the caller of `build`. */
type Waiting = {
  file: Uint8Array;
  onCoarse: (geometry: GroomGeometry) => void;
  resolve: (geometry: GroomGeometry) => void;
  reject: (error: Error) => void;
  /** How many pictures have shown the coarse geometry. Null: there is none yet, or the whole one is being made. */
  pictures: number | null;
};

/**
 * Makes grooms' geometry in a worker, one after the other. Where no worker can run (a page's policy forbids it, or
 * there are none), it runs on this thread, which then blocks for about a second for each groom.
 */
export class GroomBuilder {
  #worker: Worker | null = null;
  /** The module that builds on this thread, where no worker can run. */
  #instance: Promise<Instance> | null = null;
  #workerFailed = typeof Worker === "undefined";
  /** The number of the next request. */
  #next = 1;
  /** The grooms that are not built yet, by the numbers of their requests. */
  readonly #waiting = new Map<number, Waiting>();

  /** The worker starts at once: it is there when the first groom comes. */
  constructor() {
    this.#start();
  }

  /**
   * Builds the geometry of a .groom file. `onCoarse` may get a geometry of few strands first, to show until the promise
   * gives the whole one. Call `onPicture` for each picture that shows it.
   */
  build(file: Uint8Array, onCoarse: (geometry: GroomGeometry) => void): Promise<GroomGeometry> {
    return new Promise((resolve, reject) => {
      const id = this.#next++;
      this.#waiting.set(id, { file, onCoarse, resolve, reject, pictures: null });
      const worker = this.#start();
      if (worker) worker.postMessage({ id, file });
      else void this.#buildHere(id);
    });
  }

  /** Call it before each picture: the worker goes on from coarse geometries that have been shown for a while. */
  onPicture(): void {
    for (const [id, waiting] of this.#waiting) {
      if (waiting.pictures === null || ++waiting.pictures <= kCoarsePictures) continue;
      waiting.pictures = null;
      this.#worker?.postMessage({ id });
    }
  }

  /** Abandons the current work: its promises stay unsettled. */
  dispose(): void {
    this.#worker?.terminate();
    this.#worker = null;
    this.#waiting.clear();
  }

  #start(): Worker | null {
    if (this.#worker || this.#workerFailed) return this.#worker;
    try {
      this.#worker = new GroomWorker();
    } catch {
      this.#workerFailed = true;
      return null;
    }
    this.#worker.onmessage = ({ data }: MessageEvent<Answer>) => this.#take(data);
    this.#worker.onerror = () => this.#giveUpWorker();
    const worker = this.#worker;
    // The worker keeps requests that come before the module.
    hairModule().then(
      (module) => worker.postMessage({ module }),
      () => this.#giveUpWorker(),
    );
    return worker;
  }

  /** The worker does not run: all grooms that wait are built on this thread. */
  #giveUpWorker(): void {
    this.#worker?.terminate();
    this.#worker = null;
    this.#workerFailed = true;
    for (const id of this.#waiting.keys()) void this.#buildHere(id);
  }

  async #buildHere(id: number): Promise<void> {
    try {
      this.#instance ??= hairModule().then((module) => Instance.of(module));
      const instance = await this.#instance;
      const waiting = this.#waiting.get(id);
      if (!waiting) return;
      const groom = instance.makeOf("hairnet_groom_load", waiting.file);
      const geometry = readGeometry(instance, groom, false)!;
      instance.call("hairnet_groom_free", groom);
      this.#take({ id, geometry });
    } catch (error) {
      this.#take({ id, error: messageOf(error) });
    }
  }

  #take({ id, coarse, geometry, error }: Answer): void {
    const waiting = this.#waiting.get(id);
    if (coarse) {
      if (waiting) waiting.pictures = 0;
      return waiting?.onCoarse(coarse);
    }
    this.#waiting.delete(id);
    if (geometry) waiting?.resolve(geometry);
    else waiting?.reject(new HairnetError("invalid", error ?? "the groom's geometry could not be made"));
  }
}
