import { Groom } from "../hair/groom";
import { groomBytes } from "../hair/groomBytes";
import { inWorker } from "../module/inWorker";
import type { LevelsWork } from "./levelsWorker";
import LevelsWorker from "./levelsWorker?worker&inline";
import { localFile } from "./localModule";
import { makeLevels } from "./makeLevels";

type Progress = (share: number) => void;

/** The newest build. Builds run one after the other, because pictures need the rest of the machine. */
let last: Promise<unknown> = Promise.resolve();

/**
 * Builds the levels of a hairstyle, which a `LocalRoom` steps, as `hairnet-groom levels` does. Returns the bytes of a
 * .levels file, which serves this hairstyle and this version of Hairnet alone. Takes some seconds of a worker, or of
 * this thread where no worker can run. `onProgress` gets numbers from 0 to 1. Rejects with a one-line `HairnetError`.
 */
export async function buildLevels(
  hair: Groom | Uint8Array | ArrayBuffer,
  onProgress: Progress = () => {},
): Promise<Uint8Array<ArrayBuffer>> {
  const file = hair instanceof Groom ? hair.file : groomBytes(hair);
  const module = await localFile.compiled();
  const work: LevelsWork = { module, file };
  const built = last.then(() => inWorker(LevelsWorker, work, () => makeLevels(module, file, onProgress), onProgress));
  last = built.catch(() => {});
  return built;
}
