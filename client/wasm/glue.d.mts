/** What a module of client/wasm exports: its memory, malloc, free, and the functions of client/hairnet.h. */
export type ModuleExports = Readonly<Record<string, (...numbers: number[]) => number>> & {
  readonly memory: WebAssembly.Memory;
};

export function start(
  source: BufferSource | WebAssembly.Module,
  onLine?: (line: string) => void,
): Promise<ModuleExports>;
