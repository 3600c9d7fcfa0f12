import { defineConfig } from "vitest/config";
import { wasmFile } from "./scripts/wasmFile";

// Browsers against real servers. While one file waits, another one draws in software.
export default defineConfig({
  plugins: [wasmFile()],
  server: { fs: { allow: [".", "../shaders"] } },
  test: {
    include: ["e2e/**/*.e2e.ts"],
    globalSetup: ["test/support/levelCache.ts", "e2e/testRun.ts"],
    testTimeout: 240_000,
    // A browser that draws in software shares two hardware threads with everything else.
    retry: 1,
    hookTimeout: 120_000,
    pool: "forks",
    poolOptions: { forks: { minForks: 2, maxForks: 2 } },
  },
});
