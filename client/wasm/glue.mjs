// Starts a module that client/wasm has built, in a browser or in Node.js.

/**
 * @param {BufferSource | WebAssembly.Module} source the bytes of a .wasm file, or what was compiled of them
 * @param {(line: string) => void} [onLine] gets each line that the module writes before it ends by a failed assertion
 * @param {(share: number) => void} [onProgress] gets, from 0 to 1, how far hairnet_build_finish() is
 * @returns {Promise<WebAssembly.Exports & { memory: WebAssembly.Memory }>}
 */
export async function start(source, onLine = console.error, onProgress = () => {}) {
  let exports, text = "";
  const decoder = new TextDecoder();
  const wasi = {
    fd_close: () => 0,
    fd_seek: () => 70, // ESPIPE: a stream has no places
    fd_write(_file, parts, count, writtenAt) {
      const view = new DataView(exports.memory.buffer);
      let written = 0;
      for (let part = parts; part < parts + 8 * count; part += 8) {
        const size = view.getUint32(part + 4, true);
        text += decoder.decode(new Uint8Array(exports.memory.buffer, view.getUint32(part, true), size), { stream: true });
        written += size;
      }
      view.setUint32(writtenAt, written, true);
      const lines = text.split("\n");
      text = lines.pop();
      lines.forEach((line) => onLine(line));
      return 0;
    },
  };
  const module = source instanceof WebAssembly.Module ? source : await WebAssembly.compile(source);
  ({ exports } = await WebAssembly.instantiate(module, {
    wasi_snapshot_preview1: wasi,
    hairnet: { on_progress: onProgress }, // hairnet_local.wasm alone asks for it
  }));
  exports._initialize();
  return exports;
}
