import { client, startClient } from "../module/client";
import type { Instance } from "../module/instance";
import { groomBytes } from "./groomBytes";
import { HairnetError } from "../module/hairnetError";

/** The skull and body that a groom was made on, head space at rest, m. */
export interface Body {
  /** 3 a vertex */
  readonly vertices: Float32Array;
  /** 5 a vertex, in the order of `Bone`, of sum 1 */
  readonly boneWeights: Float32Array;
  /** 3 a triangle */
  readonly triangles: Uint32Array;
}

const kHashBytes = 32;

/** The immutable hairstyle in head space (metres), as it lies on the upright head, and the body under it. */
export class Groom {
  /** of its file: equal for equal bytes */
  readonly key: string;
  readonly name: string;
  readonly strandCount: number;
  readonly pointCount: number;
  #file: Uint8Array | null = null;
  #body: Body | null = null;

  /** Reads a .groom file. Rejects with a one-line `HairnetError`. */
  static async load(file: Uint8Array | ArrayBuffer): Promise<Groom> {
    await startClient();
    return Groom.of(file);
  }

  /** @internal The same where the client has started. */
  static of(file: Uint8Array | ArrayBuffer, module: Instance = client()): Groom {
    return new Groom(module.makeOf("hairnet_groom_load", groomBytes(file)), module);
  }

  /** @internal `handle`: a hairnet_groom of the module, which is its own from now on. */
  constructor(
    readonly handle: number,
    readonly module: Instance,
  ) {
    module.freeAfter(this, "hairnet_groom_free", handle);
    const hash = module.struct(kHashBytes, (at) => module.call("hairnet_groom_hash", handle, at));
    this.key = Array.from({ length: kHashBytes }, (_, i) => hash.getUint8(i).toString(16).padStart(2, "0")).join("");
    this.name = module.text(module.call("hairnet_groom_name", handle));
    this.strandCount = module.call("hairnet_groom_strand_count", handle);
    this.pointCount = module.call("hairnet_groom_point_count", handle);
  }

  /** The bytes of its file. */
  get file(): Uint8Array {
    this.#file ??= this.module.allBytes("hairnet_groom_file", this.handle);
    return this.#file;
  }

  /** At rest: 3 a point, strand by strand, root first; then those of threads, cards and cloths. Copied. */
  get points(): Float32Array {
    const { module } = this;
    return module.floats(module.call("hairnet_groom_points", this.handle), 3 * this.pointCount).slice();
  }

  /** strandCount + 1: strand s has points [begin[s], begin[s + 1]). Copied. */
  get strandBegin(): Uint32Array {
    const { module } = this;
    return module.words(module.call("hairnet_groom_strand_begin", this.handle), this.strandCount + 1).slice();
  }

  get body(): Body {
    if (this.#body) return this.#body;
    const { module } = this;
    const body = module.struct(20, (at) => module.call("hairnet_groom_body", this.handle, at));
    const [vertices, weights, triangles, vertexCount, triangleCount] = Array.from({ length: 5 }, (_, i) =>
      body.getUint32(4 * i, true),
    );
    this.#body = {
      vertices: module.floats(vertices, 3 * vertexCount).slice(),
      boneWeights: module.floats(weights, 5 * vertexCount).slice(),
      triangles: module.words(triangles, 3 * triangleCount).slice(),
    };
    return this.#body;
  }
}

/** Throws `HairnetError` for what is no groom, as JavaScript may pass it. */
export function checkGroom(groom: unknown, call: string): asserts groom is Groom {
  if (!(groom instanceof Groom)) throw new HairnetError("invalid", `${call}: give a Groom, of Groom.load(bytes)`);
}
