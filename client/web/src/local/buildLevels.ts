import { Groom } from "../hair/groom";
import { groomBytes } from "../hair/groomBytes";
import { HairnetError } from "../module/hairnetError";
import type { LevelsAnswer } from "./levelsWorker";
import LevelsWorker from "./levelsWorker?worker&inline";
import { localFile } from "./localModule";
import { makeLevels } from "./makeLevels";

type Progress = (share: number) => void;

/** One after the other: pictures need the rest of the machine. */
let last: Promise<unknown> = Promise.resolve();

/**
 * Builds what a `LocalRoom` steps for a hairstyle, as `hairnet-groom levels` does: a file to keep, for this very hairstyle
 * and this version of Hairnet. Takes some seconds of a worker, or of this thread where no worker can run. `onProgress`
 * gets numbers from 0 to 1. Rejects with a one-line `HairnetError`.
 */
export async function buildLevels(
  hair: Groom | Uint8Array | ArrayBuffer,
  onProgress: Progress = () => {},
): Promise<Uint8Array<ArrayBuffer>> {
  const file = hair instanceof Groom ? hair.file : groomBytes(hair);
  const module = await localFile.compiled();
  const built = last.then(() => build(module, file, onProgress));
  last = built.catch(() => {});
  return built;
}

async function build(
  module: WebAssembly.Module,
  file: Uint8Array,
  onProgress: Progress,
): Promise<Uint8Array<ArrayBuffer>> {
  const worker = startWorker();
  if (!worker) return makeLevels(module, file, onProgress);
  try {
    return await new Promise((resolve, reject) => {
      worker.onmessage = ({ data: { share, levels, fault } }: MessageEvent<LevelsAnswer>) => {
        if (share !== undefined) onProgress(share);
        else if (levels) resolve(levels);
        else reject(new HairnetError("malformed", fault ?? "the levels could not be built"));
      };
      // A page's policy may forbid it after all.
      worker.onerror = () => resolve(makeLevels(module, file, onProgress));
      worker.postMessage({ module, file });
    });
  } finally {
    worker.terminate();
  }
}

function startWorker(): Worker | null {
  if (typeof Worker === "undefined") return null;
  try {
    return new LevelsWorker();
  } catch {
    return null;
  }
}
