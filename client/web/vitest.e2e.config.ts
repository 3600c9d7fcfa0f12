import { defineConfig } from "vitest/config";

// Browsers against real servers: slow, one after the other.
export default defineConfig({
  server: { fs: { allow: [".", "../shaders"] } },
  test: {
    include: ["e2e/**/*.e2e.ts"],
    testTimeout: 240_000,
    hookTimeout: 120_000,
    retry: 1, // a browser that draws in software shares two hardware threads with the server
    fileParallelism: false,
    pool: "forks",
    poolOptions: { forks: { singleFork: true } },
  },
});
