import { defineConfig } from "vite";

// The package as one minified file with its dependencies, except three.
export default defineConfig({
  build: {
    target: "es2022",
    sourcemap: true,
    emptyOutDir: false,
    modulePreload: false,
    rollupOptions: {
      input: "src/bundle/index.ts",
      external: ["three"], // its addons are inside: an import map for three alone suffices
      preserveEntrySignatures: "strict",
      output: { format: "es", entryFileNames: "hairnet.module.min.js" },
    },
  },
});
