/** What a module of client/wasm exports: its memory, malloc, free, and the functions of client/hairnet.h. */
export type ModuleExports = Readonly<Record<string, (...values: (number | bigint)[]) => number | bigint>> & {
  readonly memory: WebAssembly.Memory;
};

export function start(
  source: BufferSource | WebAssembly.Module,
  onLine?: (line: string) => void,
  onProgress?: (share: number) => void,
): Promise<ModuleExports>;
