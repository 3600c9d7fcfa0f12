import { setTimeout as sleep } from "node:timers/promises";

/**
 * Checks every 20 ms until the condition holds. After `timeoutMs` it throws an error that names what was awaited. The
 * default of 90 s is for a machine that other tests use, too; nothing takes that long otherwise.
 */
export async function until(what: string, isSo: () => boolean | Promise<boolean>, timeoutMs = 90_000): Promise<void> {
  const endMs = performance.now() + timeoutMs;
  while (!(await isSo())) {
    if (performance.now() > endMs) throw new Error(`it did not come about that ${what}`);
    await sleep(20);
  }
}
