import { HairnetError, type ErrorCode, messageOf } from "./hairnetError";

type Progress = (share: number) => void;

/** What a worker answers: how far it is, then the result or what went wrong. */
type Answer<Result> = { share?: number; result?: Result; code?: ErrorCode; error?: string };

/**
 * Sends `work` to a new worker of this kind, which must call `doInWorker`, and returns its result. Where no worker can
 * run, `here` does the work on this thread. Rejects with a one-line `HairnetError`.
 */
export async function inWorker<Result>(
  Kind: new () => Worker,
  work: unknown,
  here: () => Promise<Result>,
  onProgress: Progress = () => {},
): Promise<Result> {
  const worker = started(Kind);
  if (!worker) return here();
  try {
    return await new Promise((resolve, reject) => {
      worker.onmessage = ({ data: { share, result, code, error } }: MessageEvent<Answer<Result>>) => {
        if (share !== undefined) onProgress(share);
        else if (result !== undefined) resolve(result);
        else reject(new HairnetError(code ?? "unsupported", error ?? "the worker has ended"));
      };
      // A page's policy may forbid a worker that could be constructed.
      worker.onerror = () => resolve(here());
      worker.postMessage(work);
    });
  } finally {
    worker.terminate();
  }
}

function started(Kind: new () => Worker): Worker | null {
  if (typeof Worker === "undefined") return null;
  try {
    return new Kind();
  } catch {
    return null;
  }
}

/**
 * Call it in a worker: it does what `inWorker` asks for by `run`. `bytesOf`: the bytes of a result, which move to the
 * page's thread instead of being copied.
 */
export function doInWorker<Work, Result>(
  run: (work: Work, onProgress: Progress) => Promise<Result>,
  bytesOf: (result: Result) => Uint8Array<ArrayBuffer>,
): void {
  const answer = (message: Answer<Result>, transfer: Transferable[] = []) => self.postMessage(message, { transfer });
  self.onmessage = async ({ data }: MessageEvent<Work>) => {
    try {
      const result = await run(data, (share) => answer({ share }));
      answer({ result }, [bytesOf(result).buffer]);
    } catch (error) {
      const code = error instanceof HairnetError ? error.code : "unsupported";
      answer({ code, error: messageOf(error) });
    }
  };
}
