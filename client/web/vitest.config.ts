import { defineConfig } from "vitest/config";

export default defineConfig({
  server: { fs: { allow: [".", "../shaders"] } }, // shaders are imported as text
  test: {
    include: ["test/**/*.test.ts"],
    testTimeout: 60_000,
    pool: "forks",
    poolOptions: { forks: { singleFork: true } }, // two hardware threads are all there may be
  },
});
