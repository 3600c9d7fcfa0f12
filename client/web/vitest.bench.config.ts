import { defineConfig } from "vitest/config";
import { wasmFile } from "./scripts/wasmFile";

// Prints times, one after the other, on an otherwise idle machine.
export default defineConfig({
  plugins: [wasmFile()],
  test: {
    include: ["test/**/*.bench.ts"],
    globalSetup: "test/support/levelCache.ts",
    testTimeout: 300_000,
    pool: "forks",
    poolOptions: { forks: { singleFork: true } },
  },
});
