import { existsSync, readFileSync } from "node:fs";
import { dirname, join, relative, resolve } from "node:path";
import { fileURLToPath } from "node:url";
import type { Plugin } from "vite";

/** The modules, by the names that src/ uses. */
const kNames = ["hairnet.wasm", "hairnet_import.wasm", "hairnet_local.wasm"];
/** The name under which src/inline.ts gets the module as base64. */
const kBase64 = "\0hairnet.wasm";
const built = fileURLToPath(new URL("../../../build/wasm/hairnet.wasm", import.meta.url));

/**
 * Gives src/ its modules: the file that HAIRNET_WASM names and the others beside it, or what deploy/wasm has built.
 * `beside`: the expressions stay as they are, which vite would replace, and the files come beside the JavaScript.
 */
export function wasmFile({ beside = false } = {}): Plugin {
  const folder = dirname(resolve(process.env.HAIRNET_WASM ?? built));
  return {
    name: "hairnet-wasm-file",
    config() {
      const missing = kNames.map((name) => join(folder, name)).find((file) => !existsSync(file));
      if (missing) throw new Error(`${missing} is missing: run deploy/wasm, or name hairnet.wasm by HAIRNET_WASM`);
      return { server: { fs: { allow: [folder] } } };
    },
    resolveId: (id) => (id.endsWith("/hairnet.wasm?inline") ? kBase64 : null),
    load: (id) => (id === kBase64 ? `export default "${readFileSync(join(folder, "hairnet.wasm"), "base64")}"` : null),
    transform(code, id) {
      // Vitest also passes this file itself, whose text has the same expressions.
      if (!id.includes("/src/")) return null;
      const name = kNames.find((each) => code.includes(inSource(each)));
      if (!name) return null;
      const place = beside ? "import.meta.hairnetFolder" : "import.meta.url";
      const path = beside ? `./${name}` : relative(dirname(id), join(folder, name));
      return { code: code.replace(inSource(name), `new URL(${JSON.stringify(path)}, ${place})`), map: null };
    },
    resolveImportMeta: (property) => (property === "hairnetFolder" ? "import.meta.url" : null),
    generateBundle() {
      if (!beside) return;
      for (const fileName of kNames)
        this.emitFile({ type: "asset", fileName, source: readFileSync(join(folder, fileName)) });
    },
  };
}

/** The expression in src/ that stands for the address of a module. */
function inSource(name: string): string {
  return `new URL("./${name}", import.meta.url)`;
}
