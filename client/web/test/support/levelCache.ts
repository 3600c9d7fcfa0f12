import { mkdirSync, readdirSync, rmSync, statSync } from "node:fs";
import { join, resolve } from "node:path";
import type { TestProject } from "vitest/node";
import { kBin, program } from "./programs";

declare module "vitest" {
  interface ProvidedContext {
    /**
     * The folder in which servers keep the levels that they have built. Servers of later runs and of tests in C++ read
     * the same folder, so each hairstyle is built once.
     */
    levelCache: string;
  }
}

/** Vitest calls this function once before all tests (`globalSetup` of vitest.config.ts). */
export default function start(project: TestProject): void {
  const folder = resolve(kBin, "../test-levels");
  mkdirSync(folder, { recursive: true });
  // A newer server may build other levels of the same hairstyle, so levels that are older than the program are removed.
  const { mtimeMs } = statSync(program("hairnet-server"));
  for (const name of readdirSync(folder)) {
    const file = join(folder, name);
    if ((statSync(file, { throwIfNoEntry: false })?.mtimeMs ?? Infinity) < mtimeMs) rmSync(file, { force: true });
  }
  project.provide("levelCache", folder);
}
