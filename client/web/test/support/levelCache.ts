import { mkdirSync, readdirSync, rmSync, statSync } from "node:fs";
import { join, resolve } from "node:path";
import type { TestProject } from "vitest/node";
import { kBin, program } from "./programs";

declare module "vitest" {
  interface ProvidedContext {
    /** Levels that one server has built, all others have, also those of later runs and of tests in C++. */
    levelCache: string;
  }
}

export default function start(project: TestProject): void {
  const folder = resolve(kBin, "../test-levels");
  mkdirSync(folder, { recursive: true });
  // Another server may build other levels.
  const { mtimeMs } = statSync(program("hairnet-server"));
  for (const name of readdirSync(folder)) {
    const file = join(folder, name);
    if ((statSync(file, { throwIfNoEntry: false })?.mtimeMs ?? Infinity) < mtimeMs) rmSync(file, { force: true });
  }
  project.provide("levelCache", folder);
}
