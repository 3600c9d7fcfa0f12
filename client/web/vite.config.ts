import { defineConfig } from "vite";
import { wasmFile } from "./scripts/wasmFile";

// The package: what an application imports. Its dependencies stay outside of it.
export default defineConfig({
  plugins: [wasmFile({ beside: true })],
  build: {
    target: "es2022",
    sourcemap: true,
    lib: {
      entry: {
        index: "src/index.ts",
        import: "src/import/index.ts",
        inline: "src/inline.ts",
        local: "src/local/index.ts",
        scene: "src/scene/index.ts",
        vrm: "src/vrm/index.ts",
      },
      formats: ["es"],
    },
    rollupOptions: {
      external: [/^three($|\/)/, "@pixiv/three-vrm"],
    },
  },
});
