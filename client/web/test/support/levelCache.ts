import { mkdtempSync, rmSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import type { TestProject } from "vitest/node";

declare module "vitest" {
  interface ProvidedContext {
    /** Levels that one server of the run has built, all others have. */
    levelCache: string;
  }
}

export default function start(project: TestProject): () => void {
  const folder = mkdtempSync(join(tmpdir(), "hairnet-levels-"));
  project.provide("levelCache", folder);
  return () => rmSync(folder, { recursive: true, force: true });
}
