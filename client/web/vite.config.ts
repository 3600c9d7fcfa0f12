import { defineConfig } from "vite";

// The package: what an application imports. Its dependencies stay outside of it.
export default defineConfig({
  build: {
    target: "es2022",
    sourcemap: true,
    lib: {
      entry: { index: "src/index.ts", scene: "src/scene/index.ts", vrm: "src/vrm/index.ts" },
      formats: ["es"],
    },
    rollupOptions: {
      external: [/^three($|\/)/, "@pixiv/three-vrm", "fflate", "flatbuffers", /^@noble\/hashes/],
    },
  },
});
