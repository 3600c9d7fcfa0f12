import { messageOf } from "../module/hairnetError";
import { Instance } from "../module/instance";
import { buffersOf } from "./geometry/groomGeometry";
import { readGeometry } from "./geometry/readGeometry";

/** Grooms of the module that were answered with a coarse geometry, by `id`. */
const grooms = new Map<number, number>();
/** Gives the module to `instance`. */
let onModule!: (module: WebAssembly.Module) => void;
const instance = new Promise<WebAssembly.Module>((resolve) => {
  onModule = resolve;
}).then((module) => Instance.of(module));

/**
 * Receives the compiled module, which all else waits for, and files of grooms. The answer to a file is a coarse
 * geometry if the whole one takes long, else the whole one, or an error. After a coarse geometry, the same `id` without
 * a file asks for the whole one.
 */
self.onmessage = async ({ data }: MessageEvent<{ module?: WebAssembly.Module; id: number; file?: Uint8Array }>) => {
  if (data.module) return onModule(data.module);
  const { id, file } = data;
  let module: Instance | undefined;
  let groom = 0;
  try {
    module = await instance;
    groom = file ? module.makeOf("hairnet_groom_load", file) : grooms.get(id)!;
    const coarse = file ? readGeometry(module, groom, true) : null;
    if (coarse) {
      grooms.set(id, groom);
      self.postMessage({ id, coarse }, { transfer: buffersOf(coarse) });
      return;
    }
    const geometry = readGeometry(module, groom, false)!;
    self.postMessage({ id, geometry }, { transfer: buffersOf(geometry) });
  } catch (error) {
    self.postMessage({ id, error: messageOf(error) });
  }
  grooms.delete(id);
  if (groom !== 0) module?.call("hairnet_groom_free", groom);
};
