// Converts flatc's binary schema (reflection.fbs) to the layout of each table: the type at each slot of its vtable.
import { ByteBuffer } from "flatbuffers";

// reflection.fbs: BaseType
const kBytes = { 1: 1, 2: 1, 3: 1, 4: 1, 5: 2, 6: 2, 7: 4, 8: 4, 9: 8, 10: 8, 11: 4, 12: 8 };
const kString = 13;
const kVector = 14;
const kObject = 15;
const kUnion = 16;

class Table {
  constructor(bytes, position) {
    this.bytes = bytes;
    this.position = position;
  }
  // The offset of the field with that number, or 0.
  at(field) {
    const offset = this.bytes.__offset(this.position, 4 + 2 * field);
    return offset && this.position + offset;
  }
  string(field) {
    return this.bytes.__string(this.at(field));
  }
  table(field) {
    const at = this.at(field);
    return at ? new Table(this.bytes, this.bytes.__indirect(at)) : null;
  }
  tables(field) {
    const at = this.at(field);
    if (!at) return [];
    const begin = this.bytes.__vector(at);
    return Array.from(
      { length: this.bytes.__vector_len(at) },
      (_, i) => new Table(this.bytes, this.bytes.__indirect(begin + 4 * i)),
    );
  }
  u8(field) {
    return this.at(field) ? this.bytes.readUint8(this.at(field)) : 0;
  }
  u16(field) {
    return this.at(field) ? this.bytes.readUint16(this.at(field)) : 0;
  }
  i32(field, otherwise) {
    return this.at(field) ? this.bytes.readInt32(this.at(field)) : otherwise;
  }
}

const shortName = (name) => name.slice(name.lastIndexOf(".") + 1);

export function layoutOf(binarySchema) {
  const bytes = new ByteBuffer(new Uint8Array(binarySchema));
  const schema = new Table(bytes, bytes.readInt32(0));
  const objects = schema.tables(0).map((object) => ({
    name: shortName(object.string(0)),
    fields: object.tables(1),
    isStruct: object.u8(2) !== 0,
    align: object.i32(3, 1),
    bytes: object.i32(4, 0),
  }));
  const enums = schema.tables(1).map((each) => ({ values: each.tables(1) }));

  const element = (base, index) => {
    if (base === kString) return { kind: "string" };
    if (base === kObject) {
      const object = objects[index];
      return object.isStruct
        ? { kind: "inline", bytes: object.bytes, align: object.align }
        : { kind: "table", table: object.name };
    }
    return { kind: "inline", bytes: kBytes[base], align: kBytes[base] };
  };

  const fieldLayout = (field) => {
    const type = field.table(1);
    const base = type.u8(0);
    const index = type.i32(2, -1);
    const common = { slot: field.u16(3), name: field.string(0), ...(field.u8(7) ? { required: true } : {}) };
    if (base === kVector) return { ...common, kind: "vector", of: element(type.u8(1), index) };
    if (base !== kUnion) return { ...common, ...element(base, index) };
    const tables = {};
    for (const value of enums[index].values) {
      const of = value.table(3);
      if (of && of.u8(0) === kObject) tables[Number(bytes.readInt64(value.at(1) || 0))] = objects[of.i32(2, -1)].name;
    }
    return { ...common, kind: "union", tables };
  };

  const layouts = {};
  for (const object of objects) {
    if (object.isStruct) continue;
    layouts[object.name] = object.fields.map(fieldLayout).sort((a, b) => a.slot - b.slot);
  }
  return layouts;
}
