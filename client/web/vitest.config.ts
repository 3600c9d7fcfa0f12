import { defineConfig } from "vitest/config";
import { wasmFile } from "./scripts/wasmFile";

export default defineConfig({
  plugins: [wasmFile()],
  // Shaders are imported as text.
  server: { fs: { allow: [".", "../shaders"] } },
  test: {
    include: ["test/**/*.test.ts"],
    globalSetup: "test/support/levelCache.ts",
    // The time is for a machine with much else to do; nothing waits that long otherwise.
    testTimeout: 300_000,
    pool: "forks",
    // There may be only two hardware threads.
    poolOptions: { forks: { singleFork: true } },
    // Modules are read once for all files.
    isolate: false,
  },
});
