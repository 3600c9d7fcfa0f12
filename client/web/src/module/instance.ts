import { start, type ModuleExports } from "../../../wasm/glue.mjs";
import { HairnetError, type ErrorCode } from "./hairnetError";

/** The room for an error's line; longer ones are cut. */
const kErrorBytes = 512;
/** The room for results of `struct`, `make` and others. */
const kResultBytes = 1024;
/** The codes of `hairnet_error` of client/hairnet.h, from 1 (HAIRNET_OK is 0). */
const kCodes: readonly ErrorCode[] = [
  "invalid",
  "malformed",
  "unreachable",
  "refused",
  "invalid",
  "too_large",
  "unsupported",
];

/**
 * The C++ client in its own memory. `call` reaches the functions of client/hairnet.h, which the module exports; 64-bit
 * numbers are `bigint`. Views of the memory are good until the next call. After a failed assertion, and after a lack of
 * memory, every call throws a `HairnetError`: the instance is of no more use.
 */
export class Instance {
  readonly #exports: ModuleExports;
  /** The address of kResultBytes bytes for results of functions. */
  readonly #results: number;
  /** The address of kErrorBytes bytes for an error's line. */
  readonly #errorText: number;
  /** The addresses of texts that `name` has put there. */
  readonly #names = new Map<string, number>();
  /** Frees handles whose owner is gone; null: the platform cannot tell. */
  readonly #unused =
    typeof FinalizationRegistry === "undefined"
      ? null
      : new FinalizationRegistry<{ free: string; handle: number }>(({ free, handle }) => this.call(free, handle));
  /** Views of the whole memory, which stay right until it grows. */
  #views: {
    readonly view: DataView;
    readonly words: Uint32Array;
    readonly floats: Float32Array;
    readonly doubles: Float64Array;
  } | null = null;

  /** `onProgress` gets, from 0 to 1, how far a building of levels is. */
  static async of(module: WebAssembly.Module, onProgress?: (share: number) => void): Promise<Instance> {
    const lines: string[] = [];
    return new Instance(await start(module, (line) => lines.push(line), onProgress), lines);
  }

  private constructor(
    exports: ModuleExports,
    /** The lines that the module wrote; after a failed assertion the last one says which. */
    private readonly lines: readonly string[],
  ) {
    this.#exports = exports;
    this.#results = Number(exports.malloc(kResultBytes));
    this.#errorText = Number(exports.malloc(kErrorBytes));
  }

  /** Frees the handle by the function `free` once nothing refers to `owner` any more. */
  freeAfter(owner: object, free: string, handle: number): void {
    this.#unused?.register(owner, { free, handle });
  }

  /** Whether the module has a function of this name: hairnet.wasm has fewer than hairnet_local.wasm. */
  has(name: string): boolean {
    return name in this.#exports;
  }

  /** Calls a function of client/hairnet.h; addresses and handles are numbers. */
  call(name: string, ...values: (number | bigint)[]): number {
    return Number(this.callWide(name, ...values));
  }

  /** Calls a function that returns a 64-bit number. */
  callWide(name: string, ...values: (number | bigint)[]): bigint {
    try {
      return this.#exports[name](...values) as bigint;
    } catch (error) {
      throw new HairnetError("unsupported", `the hair module has ended: ${this.lines.at(-1) ?? String(error)}`);
    }
  }

  /**
   * Calls a function whose last arguments are `error` and its size. Unless it returns HAIRNET_OK, throws a
   * `HairnetError` of `prefix` and the line in `error`.
   */
  check(prefix: string, name: string, ...values: (number | bigint)[]): void {
    const error = this.call(name, ...values, this.#errorText, kErrorBytes);
    if (error === 0) return;
    const line = this.text(this.#errorText) || this.text(this.call("hairnet_error_text", error));
    throw new HairnetError(kCodes[error - 1], prefix + line);
  }

  /** Calls a function whose last argument is a pointer to what it makes, and returns that. */
  make(name: string, ...values: (number | bigint)[]): number {
    this.demand(name, ...values, this.#results);
    return this.u32(this.#results);
  }

  /** Calls a function, and throws what `hairnet_error` it returns. */
  demand(name: string, ...values: (number | bigint)[]): void {
    const error = this.call(name, ...values);
    if (error !== 0) throw new HairnetError(kCodes[error - 1], this.text(this.call("hairnet_error_text", error)));
  }

  /** Calls as `check` does, with a pointer to what the function makes before `error`, and returns what it made. */
  made(prefix: string, name: string, ...values: (number | bigint)[]): number {
    this.check(prefix, name, ...values, this.#results);
    return this.u32(this.#results);
  }

  /** Calls as `made` does a function that reads a file. `values`: its arguments before the file's address and size. */
  makeOf(name: string, file: Uint8Array, ...values: (number | bigint)[]): number {
    return this.with(file, (at) => this.made("", name, ...values, at, file.length));
  }

  /** The floats that a function writes, whose last arguments are a buffer, or 0, and the address of their count. */
  allFloats(name: string, ...values: (number | bigint)[]): Float32Array<ArrayBuffer> {
    return new Float32Array(this.#all(name, 4, values).buffer);
  }
  /** The bytes that such a function writes. */
  allBytes(name: string, ...values: (number | bigint)[]): Uint8Array<ArrayBuffer> {
    return this.#all(name, 1, values);
  }
  #all(name: string, size: number, values: readonly (number | bigint)[]): Uint8Array<ArrayBuffer> {
    // The first call, without a buffer, tells the count.
    this.view().setUint32(this.#results, 0, true);
    this.call(name, ...values, 0, this.#results);
    const count = this.u32(this.#results);
    const buffer = this.allocate(size * count);
    this.view().setUint32(this.#results, count, true);
    this.call(name, ...values, buffer, this.#results);
    const all = this.copy(buffer, size * count);
    this.call("free", buffer);
    return all;
  }

  /** A copy of bytes whose address and size a function writes to its last two arguments; null: it has none. */
  bytes(name: string, ...values: (number | bigint)[]): Uint8Array | null {
    const error = this.call(name, ...values, this.#results, this.#results + 4);
    if (error !== 0) return null;
    return this.copy(this.u32(this.#results), this.u32(this.#results + 4));
  }

  /**
   * Gives `call` the address of `byteCount` bytes, at most kResultBytes, and returns a view of what it has written
   * there. The view is good until the next call.
   */
  struct(byteCount: number, call: (at: number) => void): DataView {
    call(this.#results);
    return new DataView(this.#exports.memory.buffer, this.#results, byteCount);
  }

  /** Copies bytes into the memory, calls with their address, and frees them. */
  with<T>(bytes: Uint8Array, call: (at: number) => T): T {
    const at = this.put(bytes);
    try {
      return call(at);
    } finally {
      this.call("free", at);
    }
  }

  /** Copies bytes into new memory, which the caller frees by `call("free", …)`, and returns its address. */
  put(bytes: Uint8Array): number {
    const at = this.allocate(bytes.length);
    this.write(at, bytes);
    return at;
  }

  write(at: number, bytes: Uint8Array): void {
    new Uint8Array(this.#exports.memory.buffer).set(bytes, at);
  }

  /** The address of a text with its final 0. It is never freed, and equal texts share it: for a few names. */
  name(text: string): number {
    const at = this.#names.get(text) ?? this.put(new TextEncoder().encode(`${text}\0`));
    this.#names.set(text, at);
    return at;
  }

  allocate(byteCount: number): number {
    const at = this.call("malloc", Math.max(byteCount, 1));
    if (at === 0) throw new HairnetError("unsupported", "out of memory");
    return at;
  }

  u32(at: number): number {
    return this.view().getUint32(at, true);
  }

  view(): DataView {
    return this.#memory().view;
  }

  /**
   * The whole memory as numbers of one kind, indexed by address / 4, or address / 8 for doubles. These need no new view
   * for each use. They are good until the next call.
   */
  wordMemory(): Uint32Array {
    return this.#memory().words;
  }
  floatMemory(): Float32Array {
    return this.#memory().floats;
  }
  doubleMemory(): Float64Array {
    return this.#memory().doubles;
  }

  #memory() {
    const { buffer } = this.#exports.memory;
    // The buffer is another object after the memory has grown.
    if (this.#views?.view.buffer !== buffer)
      this.#views = {
        view: new DataView(buffer),
        words: new Uint32Array(buffer),
        floats: new Float32Array(buffer),
        doubles: new Float64Array(buffer),
      };
    return this.#views;
  }

  copy(at: number, byteCount: number): Uint8Array<ArrayBuffer> {
    return new Uint8Array(this.#exports.memory.buffer).slice(at, at + byteCount);
  }

  /** A view of floats at an address, good until the next call. */
  floats(at: number, count: number): Float32Array {
    return new Float32Array(this.#exports.memory.buffer, at, count);
  }
  words(at: number, count: number): Uint32Array {
    return new Uint32Array(this.#exports.memory.buffer, at, count);
  }
  doubles(at: number, count: number): Float64Array {
    return new Float64Array(this.#exports.memory.buffer, at, count);
  }

  /** The text at an address, up to a byte of 0; "" at the address 0. */
  text(at: number): string {
    if (at === 0) return "";
    const bytes = new Uint8Array(this.#exports.memory.buffer);
    return new TextDecoder().decode(bytes.slice(at, bytes.indexOf(0, at)));
  }
}
