import { defineConfig } from "vitest/config";
import { wasmFile } from "./scripts/wasmFile";

export default defineConfig({
  plugins: [wasmFile()],
  server: { fs: { allow: [".", "../shaders"] } }, // shaders are imported as text
  test: {
    include: ["test/**/*.test.ts"],
    globalSetup: "test/support/levelCache.ts",
    testTimeout: 300_000, // for a machine with much else to do; nothing waits so long
    pool: "forks",
    poolOptions: { forks: { singleFork: true } }, // two hardware threads are all there may be
    isolate: false, // modules are read once for all files
  },
});
