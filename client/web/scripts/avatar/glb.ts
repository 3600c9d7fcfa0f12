import { BufferGeometry, Float32BufferAttribute } from "three";

/** A place or a direction, x y z, m. */
export type Vector = readonly [number, number, number];
/** Linear RGB. */
export type Colour = readonly [number, number, number];

/** A joint and its share of a vertex; the other joint has the rest. */
export interface Joints {
  readonly first: number;
  readonly second: number;
  readonly firstShare: number;
}

/** The types of numbers in arrays, as glTF names them (`componentType`). */
const kFloat = 5126;
const kUnsignedInt = 5125;
const kUnsignedShort = 5123;

/** A skinned mesh with a colour for each vertex. */
export class SkinnedMeshBytes {
  readonly #positions: number[] = [];
  readonly #colours: number[] = [];
  readonly #joints: number[] = [];
  readonly #weights: number[] = [];
  readonly #indices: number[] = [];

  constructor(
    readonly name: string,
    readonly roughness: number,
  ) {}

  /**
   * A closed skin of `rings` rings of `turns` points. `point`: for along and around from 0 to 1; around runs from +Z to
   * +X when along runs down.
   */
  addSkin(
    rings: number,
    turns: number,
    point: (along: number, around: number) => Vector,
    joints: (along: number) => Joints,
    colour: (point: Vector) => Colour,
  ): void {
    const first = this.#positions.length / 3;
    for (let i = 0; i <= rings; ++i)
      for (let j = 0; j < turns; ++j) {
        const at = point(i / rings, j / turns);
        const joint = joints(i / rings);
        this.#positions.push(...at);
        this.#colours.push(...colour(at));
        this.#joints.push(joint.first, joint.second, 0, 0);
        this.#weights.push(joint.firstShare, 1 - joint.firstShare, 0, 0);
        if (i === rings) continue;
        const a = first + i * turns + j;
        const b = first + i * turns + ((j + 1) % turns);
        this.#indices.push(a, a + turns, b, b, a + turns, b + turns);
      }
  }

  /** `turn`: +1, or -1 to turn it half a turn about +Y. */
  write(glb: GlbBytes, turn: 1 | -1): { attributes: object; indices: number } {
    const turned = this.#positions.map((x, n) => (n % 3 === 1 ? x : turn * x));
    const geometry = new BufferGeometry();
    geometry.setAttribute("position", new Float32BufferAttribute(turned, 3));
    geometry.setIndex(this.#indices);
    geometry.computeVertexNormals();
    return {
      attributes: {
        POSITION: glb.addArray(new Float32Array(turned), 3, "VEC3", kFloat),
        NORMAL: glb.addArray(new Float32Array(geometry.attributes.normal.array), 3, "VEC3", kFloat),
        COLOR_0: glb.addArray(new Float32Array(this.#colours), 3, "VEC3", kFloat),
        JOINTS_0: glb.addArray(new Uint16Array(this.#joints), 4, "VEC4", kUnsignedShort),
        WEIGHTS_0: glb.addArray(new Float32Array(this.#weights), 4, "VEC4", kFloat),
      },
      indices: glb.addArray(new Uint32Array(this.#indices), 1, "SCALAR", kUnsignedInt),
    };
  }
}

/** The binary part of a glTF file. */
export class GlbBytes {
  readonly accessors: object[] = [];
  readonly bufferViews: object[] = [];
  readonly #chunks: Uint8Array[] = [];
  /** The size of all chunks. */
  #bytes = 0;

  /**
   * Adds an array of elements of `size` numbers each, and returns the index of its accessor. `type`: the kind of
   * element as glTF names it, such as "VEC3".
   */
  addArray(array: Float32Array | Uint16Array | Uint32Array, size: number, type: string, componentType: number): number {
    const chunk = new Uint8Array(4 * Math.ceil(array.byteLength / 4));
    chunk.set(new Uint8Array(array.buffer, array.byteOffset, array.byteLength));
    this.bufferViews.push({ buffer: 0, byteOffset: this.#bytes, byteLength: array.byteLength });
    // glTF wants the bounds of positions, which are three numbers each.
    const axes = [0, 1, 2].map((axis) => Array.from(array).filter((_, i) => i % size === axis));
    const min = axes.map((values) => values.reduce((a, b) => Math.min(a, b), Infinity));
    const max = axes.map((values) => values.reduce((a, b) => Math.max(a, b), -Infinity));
    this.accessors.push({
      bufferView: this.bufferViews.length - 1,
      componentType,
      count: array.length / size,
      type,
      ...(type === "VEC3" ? { min, max } : {}),
    });
    this.#chunks.push(chunk);
    this.#bytes += chunk.length;
    return this.accessors.length - 1;
  }

  /** The whole file; `json` becomes complete with the buffers. */
  file(json: object): Uint8Array<ArrayBuffer> {
    const { accessors, bufferViews } = this;
    const whole = { ...json, accessors, bufferViews, buffers: [{ byteLength: this.#bytes }] };
    const text = new TextEncoder().encode(JSON.stringify(whole));
    const textBytes = 4 * Math.ceil(text.length / 4);
    // The header has 12 bytes: "glTF", the version 2 and the size of the file. Each of the two chunks, "JSON" and
    // "BIN", begins with 8 bytes: its size and its kind. Spaces fill the JSON up to a multiple of 4 bytes.
    const out = new Uint8Array(28 + textBytes + this.#bytes);
    const view = new DataView(out.buffer);
    for (const [n, word] of [0x46546c67, 2, out.length, textBytes, 0x4e4f534a].entries())
      view.setUint32(4 * n, word, true);
    out.fill(0x20, 20, 20 + textBytes);
    out.set(text, 20);
    view.setUint32(20 + textBytes, this.#bytes, true);
    view.setUint32(24 + textBytes, 0x004e4942, true);
    let at = 28 + textBytes;
    for (const chunk of this.#chunks) {
      out.set(chunk, at);
      at += chunk.length;
    }
    return out;
  }
}
