import { Instance } from "../module/instance";

/** Progress is reported in steps of 1 %. */
const kReportedShare = 0.01;

/** Builds the levels of a groom's file, and returns the bytes of a .levels file. It blocks the thread for seconds. */
export async function makeLevels(
  module: WebAssembly.Module,
  file: Uint8Array,
  onProgress: (share: number) => void,
): Promise<Uint8Array<ArrayBuffer>> {
  let reported = 0;
  // The build has an instance of its own, so that the memory which it takes is freed with the instance.
  const instance = await Instance.of(module, (share) => {
    if (share < reported + kReportedShare) return;
    reported = share;
    onProgress(share);
  });
  const groom = instance.makeOf("hairnet_groom_load", file);
  const levels = instance.make("hairnet_build_finish", instance.make("hairnet_build_begin", groom));
  return instance.allBytes("hairnet_levels_file", levels);
}
