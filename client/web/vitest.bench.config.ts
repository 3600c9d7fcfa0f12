import { defineConfig } from "vitest/config";

// Prints times, one after the other, on an otherwise idle machine.
export default defineConfig({
  test: {
    include: ["test/**/*.bench.ts"],
    testTimeout: 300_000,
    pool: "forks",
    poolOptions: { forks: { singleFork: true } },
  },
});
