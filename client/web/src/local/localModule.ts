import { startClient } from "../module/client";
import { Instance } from "../module/instance";
import { ModuleFile, readFile, setModule } from "../module/moduleFile";

/** The file of the module that has all of the C++ client: also worlds, and the building of levels. */
export const localFile = new ModuleFile(() =>
  readFile(new URL("./hairnet_local.wasm", import.meta.url), "or let a bundler that knows new URL() copy it"),
);
/** A second module, for a page whose first one cannot make worlds. */
let beside: Promise<Instance> | null = null;

/** Starts that module. It becomes the page's only module, unless the page has started another one before. */
export async function startLocalClient(): Promise<Instance> {
  setModule(localFile);
  const started = await startClient();
  if (started.has("hairnet_world_make")) return started;
  beside ??= localFile.compiled().then((module) => Instance.of(module));
  beside.catch(() => (beside = null));
  return beside;
}
