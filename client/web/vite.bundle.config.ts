import { defineConfig } from "vite";
import { wasmFile } from "./scripts/wasmFile";

// The package as one minified file with its dependencies, except three.
export default defineConfig({
  plugins: [wasmFile({ beside: true })],
  build: {
    target: "es2022",
    sourcemap: true,
    emptyOutDir: false,
    modulePreload: false,
    rollupOptions: {
      input: "src/bundle/index.ts",
      // The addons of three are inside, so an import map for three alone is enough.
      external: ["three"],
      preserveEntrySignatures: "strict",
      output: { format: "es", entryFileNames: "hairnet.module.min.js" },
    },
  },
});
