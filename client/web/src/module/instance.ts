import { start, type ModuleExports } from "../../../wasm/glue.mjs";
import { HairnetError } from "../hair/hairnetError";

const kWhyBytes = 256;

/**
 * The C++ client in its own memory. `call` reaches the functions of client/hairnet.h, which the module exports. Views of
 * the memory are good until the next call.
 */
export class Instance {
  readonly #exports: ModuleExports;
  /** for results of functions: numbers and pointers */
  readonly #results: number;
  readonly #why: number;

  static async of(module: WebAssembly.Module): Promise<Instance> {
    return new Instance(await start(module, (line) => console.error(line)));
  }

  private constructor(exports: ModuleExports) {
    this.#exports = exports;
    this.#results = exports.malloc(64);
    this.#why = exports.malloc(kWhyBytes);
  }

  call(name: string, ...numbers: number[]): number {
    return this.#exports[name](...numbers);
  }

  /** Calls a function whose last argument is a pointer to what it makes, and returns that. */
  make(name: string, ...numbers: number[]): number {
    const error = this.call(name, ...numbers, this.#results);
    if (error !== 0) throw new HairnetError("invalid", this.#textOf(this.call("hairnet_error_text", error)));
    return this.u32(this.#results);
  }

  /** The same of one that says in a line what is wrong with a file's bytes. */
  makeOf(name: string, file: Uint8Array): number {
    const at = this.put(file);
    const error = this.call(name, at, file.length, this.#results, this.#why, kWhyBytes);
    this.call("free", at);
    if (error !== 0) throw new HairnetError("malformed", this.#textOf(this.#why));
    return this.u32(this.#results);
  }

  /** The bytes that a function tells by two pointers at its end; null: it has none. Copied. */
  bytes(name: string, ...numbers: number[]): Uint8Array | null {
    const error = this.call(name, ...numbers, this.#results, this.#results + 4);
    if (error !== 0) return null;
    const at = this.u32(this.#results);
    return this.#memory.slice(at, at + this.u32(this.#results + 4));
  }

  /** What `call` writes to the place that it is given, of at most 64 bytes. */
  struct(byteCount: number, call: (at: number) => void): DataView {
    call(this.#results);
    return new DataView(this.#memory.slice(this.#results, this.#results + byteCount).buffer);
  }

  /** To be freed by `call("free", …)`. */
  put(bytes: Uint8Array): number {
    const at = this.#exports.malloc(bytes.length);
    if (at === 0) throw new HairnetError("unsupported", "out of memory");
    this.#memory.set(bytes, at);
    return at;
  }

  u32(at: number): number {
    return new DataView(this.#exports.memory.buffer).getUint32(at, true);
  }

  get #memory(): Uint8Array {
    return new Uint8Array(this.#exports.memory.buffer);
  }

  #textOf(at: number): string {
    const bytes = this.#memory;
    return new TextDecoder().decode(bytes.slice(at, bytes.indexOf(0, at)));
  }
}
