import { fileURLToPath } from "node:url";
import { defineConfig } from "vite";
import { wasmFile } from "./scripts/wasmFile";

const here = (path: string) => fileURLToPath(new URL(path, import.meta.url));
const server = process.env.HAIRNET_DEV_SERVER ?? "http://127.0.0.1:7420";

// The pages that a server hands out (hairnet-server --web-root client/web/dist-page).
export default defineConfig({
  plugins: [wasmFile()],
  root: here("page"),
  base: "./",
  build: {
    target: "es2022",
    outDir: here("dist-page"),
    emptyOutDir: true,
    sourcemap: false,
    assetsInlineLimit: 0,
    chunkSizeWarningLimit: 1100,
    rollupOptions: {
      // A server knows by these hashes which files never change.
      output: { hashCharacters: "hex" },
    },
  },
  server: {
    fs: { allow: [here("..")] },
    proxy: { "/ws": { target: server, ws: true } },
  },
});
