import { HairnetError } from "../hair/hairnetError";

/** One field of a table: its slot in the vtable, and what lies there. Generated from the schema. */
export interface FieldLayout {
  readonly slot: number;
  readonly name: string;
  readonly required?: boolean;
  readonly kind: "inline" | "string" | "table" | "vector" | "union";
  readonly bytes?: number;
  readonly align?: number;
  readonly table?: string;
  readonly of?: ElementLayout;
  readonly tables?: Readonly<Record<number, string>>;
}

export interface ElementLayout {
  readonly kind: "inline" | "string" | "table";
  readonly bytes?: number;
  readonly align?: number;
  readonly table?: string;
}

export type TableLayout = readonly FieldLayout[];

const kDepthMax = 8;
const kTablesMax = 64;
// Beyond it a vtable's numbers read as negative.
const kVtableNumberMax = 0x7fff;
const kPrefixBytes = 4;
const kIdentifierAt = 8;
const kBytesMin = 16;

/** Whether the bytes begin as a size-prefixed buffer of that kind; they may end anywhere. */
export function hasIdentifier(bytes: Uint8Array, identifier: string): boolean {
  return [...identifier].every((letter, i) => bytes[kIdentifierAt + i] === letter.charCodeAt(0));
}

/**
 * Makes sure that `bytes` is one size-prefixed FlatBuffers buffer with that identifier, whose root is `table`, and that
 * every offset, length and alignment in it is sound: what flatbuffers::Verifier does in C++, and generated TypeScript
 * does not do. Throws `HairnetError` (malformed). Values are not looked at.
 */
export function verifyBuffer(
  bytes: Uint8Array,
  identifier: string,
  table: string,
  layouts: Readonly<Record<string, TableLayout>>,
): void {
  const view = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
  if (bytes.length < kBytesMin) throw malformed("too short");
  if (view.getUint32(0, true) !== bytes.length - kPrefixBytes) throw malformed("its length is not what it says");
  if (!hasIdentifier(bytes, identifier)) throw malformed(`no ${identifier} identifier`);
  const verifier = new Verifier(view, layouts);
  verifier.table(verifier.follow(kPrefixBytes), table, 1);
}

function malformed(why: string): HairnetError {
  return new HairnetError("malformed", `not whole: ${why}`);
}

class Verifier {
  #tables = 0;

  constructor(
    private readonly view: DataView,
    private readonly layouts: Readonly<Record<string, TableLayout>>,
  ) {}

  /** Where the offset that lies at `at` leads to. */
  follow(at: number): number {
    this.#within(at, 4, 4);
    const offset = this.view.getUint32(at, true);
    if (offset === 0 || offset >= 0x80000000) throw malformed("an offset leads nowhere");
    this.#within(at + offset, 1, 1);
    return at + offset;
  }

  table(at: number, name: string, depth: number): void {
    if (depth > kDepthMax || ++this.#tables > kTablesMax) throw malformed("tables nested too deep, or too many");
    this.#within(at, 4, 4);
    const vtable = at - this.view.getInt32(at, true);
    this.#within(vtable, 2, 2);
    const vtableBytes = this.view.getUint16(vtable, true);
    if (vtableBytes % 2 !== 0 || vtableBytes > kVtableNumberMax) throw malformed("a vtable's length");
    this.#within(vtable, vtableBytes, 2);
    for (const field of this.layouts[name]) {
      const offset = field.slot < vtableBytes ? this.view.getUint16(vtable + field.slot, true) : 0;
      if (offset === 0) {
        if (field.required) throw malformed(`${name} has no ${field.name}`);
        continue;
      }
      if (offset > kVtableNumberMax) throw malformed("a field lies nowhere");
      this.#field(at, vtable, vtableBytes, at + offset, field, depth);
    }
  }

  #field(table: number, vtable: number, vtableBytes: number, at: number, field: FieldLayout, depth: number): void {
    switch (field.kind) {
      case "inline":
        return this.#within(at, field.bytes!, field.align!);
      case "string":
        return this.#string(this.follow(at));
      case "table":
        return this.table(this.follow(at), field.table!, depth + 1);
      case "vector":
        return this.#vector(this.follow(at), field.of!, depth);
      case "union": {
        // Its type is the field before.
        const typeSlot = field.slot - 2;
        const typeOffset = typeSlot < vtableBytes ? this.view.getUint16(vtable + typeSlot, true) : 0;
        const type = typeOffset === 0 ? 0 : this.view.getUint8(table + typeOffset);
        const body = this.follow(at);
        const name = field.tables![type];
        if (name) this.table(body, name, depth + 1);
      }
    }
  }

  #vector(at: number, of: ElementLayout, depth: number): void {
    this.#within(at, 4, 4);
    const count = this.view.getUint32(at, true);
    const each = of.kind === "inline" ? of.bytes! : 4;
    this.#within(at + 4, count * each, count === 0 ? 1 : (of.align ?? 4));
    if (of.kind === "inline") return;
    for (let i = 0; i < count; ++i) {
      const element = this.follow(at + 4 + 4 * i);
      if (of.kind === "string") this.#string(element);
      else this.table(element, of.table!, depth + 1);
    }
  }

  #string(at: number): void {
    this.#within(at, 4, 4);
    const bytes = this.view.getUint32(at, true);
    this.#within(at + 4, bytes + 1, 1);
    if (this.view.getUint8(at + 4 + bytes) !== 0) throw malformed("a string without its end");
  }

  #within(at: number, bytes: number, align: number): void {
    if (at < 0 || at + bytes > this.view.byteLength) throw malformed("something lies beyond its end");
    if (at % align !== 0) throw malformed("something is not aligned");
  }
}
