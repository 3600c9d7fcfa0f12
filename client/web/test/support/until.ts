import { setTimeout as sleep } from "node:timers/promises";

/** Looks every now and then until it is so; fails with what was waited for. */
export async function until(what: string, isSo: () => boolean | Promise<boolean>, timeoutMs = 90_000): Promise<void> {
  const endMs = performance.now() + timeoutMs;
  while (!(await isSo())) {
    if (performance.now() > endMs) throw new Error(`it did not come about that ${what}`);
    await sleep(20);
  }
}
