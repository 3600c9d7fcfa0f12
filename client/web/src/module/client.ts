import { HairnetError } from "./hairnetError";
import { Instance } from "./instance";
import { hairModule } from "./moduleFile";

let instance: Instance | null = null;
let starting: Promise<Instance> | null = null;

/** Starts the C++ client on this thread, once; `connect` and `Groom.load` wait for it. */
export function startClient(): Promise<Instance> {
  starting ??= hairModule()
    .then((module) => Instance.of(module))
    .then((started) => (instance = started));
  // After a failure, such as a file that did not arrive, the next call tries again.
  starting.catch(() => (starting = null));
  return starting;
}

/** The C++ client of this thread, which must have started. */
export function client(): Instance {
  if (!instance)
    throw new HairnetError("invalid", "the hair module has not started: await connect() or Groom.load() before");
  return instance;
}
