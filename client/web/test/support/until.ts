import { setTimeout as sleep } from "node:timers/promises";

/** Checks repeatedly until the condition holds; the error names what was awaited. */
export async function until(what: string, isSo: () => boolean | Promise<boolean>, timeoutMs = 90_000): Promise<void> {
  const endMs = performance.now() + timeoutMs;
  while (!(await isSo())) {
    if (performance.now() > endMs) throw new Error(`it did not come about that ${what}`);
    await sleep(20);
  }
}
