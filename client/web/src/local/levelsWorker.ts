import { doInWorker } from "../module/inWorker";
import { makeLevels } from "./makeLevels";

/** What `buildLevels` asks for. */
export interface LevelsWork {
  readonly module: WebAssembly.Module;
  readonly file: Uint8Array;
}

doInWorker(
  ({ module, file }: LevelsWork, onProgress) => makeLevels(module, file, onProgress),
  (levels) => levels,
);
