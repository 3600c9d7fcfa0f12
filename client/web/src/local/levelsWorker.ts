import { makeLevels } from "./makeLevels";

/** What a worker answers: how far it is, then the file or what went wrong. */
export type LevelsAnswer = { share?: number; levels?: Uint8Array<ArrayBuffer>; fault?: string };

const answer = (message: LevelsAnswer, transfer: Transferable[] = []) => self.postMessage(message, { transfer });

self.onmessage = async ({ data }: MessageEvent<{ module: WebAssembly.Module; file: Uint8Array }>) => {
  try {
    const levels = await makeLevels(data.module, data.file, (share) => answer({ share }));
    answer({ levels }, [levels.buffer]);
  } catch (fault) {
    answer({ fault: fault instanceof Error ? fault.message : String(fault) });
  }
};
