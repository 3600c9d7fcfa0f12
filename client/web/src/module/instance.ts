import { start, type ModuleExports } from "../../../wasm/glue.mjs";
import { HairnetError, type ErrorCode } from "./hairnetError";

const kErrorBytes = 512;
const kResultBytes = 1024;
/** `hairnet_error` of client/hairnet.h, from 1. */
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
  /** for results of functions */
  readonly #results: number;
  readonly #errorText: number;
  readonly #names = new Map<string, number>();
  /** what is not used any more leaves the memory */
  readonly #unused =
    typeof FinalizationRegistry === "undefined"
      ? null
      : new FinalizationRegistry<{ free: string; handle: number }>(({ free, handle }) => this.call(free, handle));
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
    /** that the module wrote before it ended */
    private readonly lines: readonly string[],
  ) {
    this.#exports = exports;
    this.#results = Number(exports.malloc(kResultBytes));
    this.#errorText = Number(exports.malloc(kErrorBytes));
  }

  /** Frees what `handle` is, by that function, once nobody refers to `owner` any more. */
  freeAfter(owner: object, free: string, handle: number): void {
    this.#unused?.register(owner, { free, handle });
  }

  has(name: string): boolean {
    return name in this.#exports;
  }

  call(name: string, ...values: (number | bigint)[]): number {
    return Number(this.callWide(name, ...values));
  }

  /** The same of a function that returns a 64-bit number. */
  callWide(name: string, ...values: (number | bigint)[]): bigint {
    try {
      return this.#exports[name](...values) as bigint;
    } catch (error) {
      throw new HairnetError("unsupported", `the hair module has ended: ${this.lines.at(-1) ?? String(error)}`);
    }
  }

  /**
   * Calls a function whose last arguments are `error` and its size. Throws that line as a `HairnetError`, behind `prefix`,
   * where it does not return HAIRNET_OK.
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

  /** The same of one that says in a line what is wrong; throws it behind `prefix`. */
  made(prefix: string, name: string, ...values: (number | bigint)[]): number {
    this.check(prefix, name, ...values, this.#results);
    return this.u32(this.#results);
  }

  /** The same of one that reads a file's bytes. `values`: its arguments before those. */
  makeOf(name: string, file: Uint8Array, ...values: (number | bigint)[]): number {
    return this.with(file, (at) => this.made("", name, ...values, at, file.length));
  }

  /** What a function writes that takes a buffer of floats, and the place of their number. */
  allFloats(name: string, ...values: (number | bigint)[]): Float32Array<ArrayBuffer> {
    return new Float32Array(this.#all(name, 4, values).buffer);
  }
  /** The same of bytes. */
  allBytes(name: string, ...values: (number | bigint)[]): Uint8Array<ArrayBuffer> {
    return this.#all(name, 1, values);
  }
  #all(name: string, size: number, values: readonly (number | bigint)[]): Uint8Array<ArrayBuffer> {
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

  /** The bytes that a function tells by two pointers at its end; null: it has none. Copied. */
  bytes(name: string, ...values: (number | bigint)[]): Uint8Array | null {
    const error = this.call(name, ...values, this.#results, this.#results + 4);
    if (error !== 0) return null;
    return this.copy(this.u32(this.#results), this.u32(this.#results + 4));
  }

  /** A view of what `call` writes to the place that it is given, of at most 1024 bytes; good until the next call. */
  struct(byteCount: number, call: (at: number) => void): DataView {
    call(this.#results);
    return new DataView(this.#exports.memory.buffer, this.#results, byteCount);
  }

  /** Calls with the place of these bytes in the memory, which is freed afterwards. */
  with<T>(bytes: Uint8Array, call: (at: number) => T): T {
    const at = this.put(bytes);
    try {
      return call(at);
    } finally {
      this.call("free", at);
    }
  }

  /** To be freed by `call("free", …)`. */
  put(bytes: Uint8Array): number {
    const at = this.allocate(bytes.length);
    this.write(at, bytes);
    return at;
  }

  write(at: number, bytes: Uint8Array): void {
    new Uint8Array(this.#exports.memory.buffer).set(bytes, at);
  }

  /** A text with its final 0, kept for ever: for a few names. */
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

  /** The whole memory as numbers of each kind, which need no view of their own: by place / 4, and doubles by place / 8. */
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
    // It is another one after the memory has grown.
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

  /** Until the next call. */
  floats(at: number, count: number): Float32Array {
    return new Float32Array(this.#exports.memory.buffer, at, count);
  }
  words(at: number, count: number): Uint32Array {
    return new Uint32Array(this.#exports.memory.buffer, at, count);
  }
  doubles(at: number, count: number): Float64Array {
    return new Float64Array(this.#exports.memory.buffer, at, count);
  }

  /** Of bytes up to a 0. */
  text(at: number): string {
    if (at === 0) return "";
    const bytes = new Uint8Array(this.#exports.memory.buffer);
    return new TextDecoder().decode(bytes.slice(at, bytes.indexOf(0, at)));
  }
}
