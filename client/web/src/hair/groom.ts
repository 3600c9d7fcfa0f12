import { client, startClient } from "../module/client";
import type { Instance } from "../module/instance";
import { groomBytes } from "./groomBytes";
import { HairnetError } from "../module/hairnetError";

/** The skull and body that a groom was made on, head space at rest, m. */
export interface Body {
  /** 3 numbers a vertex. */
  readonly vertices: Float32Array;
  /** 5 numbers a vertex: the weight of each bone, in the order of `Bone`; their sum is 1. */
  readonly boneWeights: Float32Array;
  /** 3 indices of vertices a triangle. */
  readonly triangles: Uint32Array;
}

/** The size of what hairnet_groom_hash writes. */
const kHashBytes = 32;

/** The immutable hairstyle in head space (metres), as it lies on the upright head, and the body under it. */
export class Groom {
  /** The hash of the file's bytes, in hexadecimal digits: equal for equal files. */
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

  /** @internal Reads a .groom file into `module`, which must have started. */
  static of(file: Uint8Array | ArrayBuffer, module: Instance = client()): Groom {
    return new Groom(module.makeOf("hairnet_groom_load", groomBytes(file)), module);
  }

  /** @internal `handle`: a hairnet_groom of the module. This object owns it from now on. */
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

  /** The bytes of the .groom file. */
  get file(): Uint8Array {
    this.#file ??= this.module.allBytes("hairnet_groom_file", this.handle);
    return this.#file;
  }

  /**
   * The points at rest, 3 numbers each: strand by strand, root first, then the points of threads, cards and cloths. A
   * copy.
   */
  get points(): Float32Array {
    const { module } = this;
    return module.floats(module.call("hairnet_groom_points", this.handle), 3 * this.pointCount).slice();
  }

  /** Strand s has the points from begin[s] to before begin[s + 1]; strandCount + 1 numbers. A copy. */
  get strandBegin(): Uint32Array {
    const { module } = this;
    return module.words(module.call("hairnet_groom_strand_begin", this.handle), this.strandCount + 1).slice();
  }

  get body(): Body {
    if (this.#body) return this.#body;
    const { module } = this;
    // hairnet_body has three addresses (vertices, weights, triangles) and two counts, of 4 bytes each.
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

/**
 * Throws `HairnetError` if the value, which JavaScript may pass, is no groom. `call` names the function in the message.
 */
export function checkGroom(groom: unknown, call: string): asserts groom is Groom {
  if (!(groom instanceof Groom)) throw new HairnetError("invalid", `${call}: give a Groom, of Groom.load(bytes)`);
}
