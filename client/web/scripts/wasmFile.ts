import { existsSync, readFileSync } from "node:fs";
import { dirname, relative, resolve } from "node:path";
import { fileURLToPath } from "node:url";
import type { Plugin } from "vite";

const kInSource = 'new URL("./hairnet.wasm", import.meta.url)';
const kBase64 = "\0hairnet.wasm";
const built = fileURLToPath(new URL("../../../build/wasm/hairnet.wasm", import.meta.url));

/**
 * Gives src/module its hairnet.wasm: the file that HAIRNET_WASM names, or the one that deploy/wasm has built. `beside`:
 * the expression stays as it is, which vite would replace, and the file comes beside the JavaScript.
 */
export function wasmFile({ beside = false } = {}): Plugin {
  const file = resolve(process.env.HAIRNET_WASM ?? built);
  return {
    name: "hairnet-wasm-file",
    config() {
      if (!existsSync(file)) throw new Error(`${file} is missing: run deploy/wasm, or name it by HAIRNET_WASM`);
      return { server: { fs: { allow: [dirname(file)] } } };
    },
    resolveId: (id) => (id.endsWith("/hairnet.wasm?inline") ? kBase64 : null),
    load: (id) => (id === kBase64 ? `export default "${readFileSync(file, "base64")}"` : null),
    transform(code, id) {
      // Vitest shows it this file, too.
      if (!id.endsWith("/src/module/moduleFile.ts")) return null;
      const place = beside ? "import.meta.hairnetFolder" : "import.meta.url";
      const name = beside ? "./hairnet.wasm" : relative(dirname(id), file);
      return { code: code.replace(kInSource, `new URL(${JSON.stringify(name)}, ${place})`), map: null };
    },
    resolveImportMeta: (property) => (property === "hairnetFolder" ? "import.meta.url" : null),
    generateBundle() {
      if (beside) this.emitFile({ type: "asset", fileName: "hairnet.wasm", source: readFileSync(file) });
    },
  };
}
