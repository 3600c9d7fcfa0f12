import type { Appearance } from "../hair/appearance";
import { Groom } from "../hair/groom";
import type { LevelIndex } from "../hair/level";
import { nodeCount, type Basis, type MovedLattice, type MovedModes, type ShownLattice } from "../hair/movedLattice";
import { kPoseNumbers } from "../hair/pose";
import type { Skin } from "../hair/skin";
import { Block } from "../module/block";
import type { Instance } from "../module/instance";

/** The size of `hairnet_shown` (client/hairnet.h) in the module, and below the byte offsets of its fields. */
const kShownBytes = 416;
enum At {
  member = 0,
  own = 4,
  session = 8,
  ownerCharacter = 16,
  level = 20,
  hasPose = 24,
  hasHair = 28,
  moves = 32,
  appearance = 36,
  pose = 56,
  hash = 336,
  tag = 340,
  tagSize = 344,
  error = 348,
  delayS = 352,
  coefficients = 360,
  coefficientCount = 364,
  origin = 368,
  spacing = 380,
  counts = 392,
  basis = 404,
  modeCount = 408,
}
/** HAIRNET_HASH_BYTES of client/hairnet.h. */
const kHashBytes = 32;
/** The size of `hairnet_skin_grid` (client/hairnet.h) in the module: nine fields of 4 bytes. */
const kSkinGridBytes = 36;

/** What a room or a world shows, read from the module (`hairnet_scene`). */
export class Scene {
  /** The bases of modes by the number that the module gives each of them (`hairnet_lattice.basis`). */
  readonly #bases = new Map<number, ModuleBasis>();
  /** The `hairnet_shown` of all characters, one behind the other, as `read` found them. */
  readonly #shown: Block;
  /** The view that `at` returns. Each call of `at` moves it to another character. */
  readonly #one: Shown;

  constructor(
    readonly module: Instance,
    readonly handle: number,
    /**
     * The module frees the room or world of `handle` once nothing refers to this object (`Instance.freeAfter`). The
     * scene refers to it, because a program may use a member after it has dropped the room.
     */
    readonly owner: object,
  ) {
    this.#one = new Shown(module);
    this.#shown = new Block(module);
  }

  /** Reads all characters again, and returns their number. The functions below take indices of this reading. */
  read(): number {
    const { module, handle } = this;
    const count = module.call("hairnet_shown_count", handle);
    module.demand("hairnet_get_shown", handle, 0, this.#shown.reserve(kShownBytes * count), count);
    return count;
  }

  /** The character at `index`. The result is one shared view: it is valid until the next call of this or the module. */
  at(index: number): Shown {
    return this.#one.at(this.#shown.at + kShownBytes * index);
  }

  /** The member number of the character at `index`, which is the first field of its `hairnet_shown`. */
  memberAt(index: number): number {
    return this.module.u32(this.#shown.at + kShownBytes * index);
  }

  /**
   * The groom of the character at `index`. Throws `HairnetError` where the module has no groom of it (`Shown.hasHair`).
   */
  groomOf(index: number): Groom {
    return new Groom(this.module.make("hairnet_shown_groom", this.handle, index), this.module);
  }

  /** The skin that the hair of a character is kept out of; null where the module has none (yet). */
  skinOf(index: number): Skin | null {
    const { module } = this;
    let error = 0;
    // A hairnet_skin has five fields of 4 bytes: two addresses, the counts of grids and nodes, and the thickness.
    const skin = module.struct(20, (at) => (error = module.call("hairnet_shown_skin", this.handle, index, at)));
    if (error !== 0) return null;
    const [grids, nodes, gridCount, count] = [0, 4, 8, 12].map((at) => skin.getUint32(at, true));
    const thicknessM = skin.getFloat32(16, true);
    const view = module.view();
    const triple = (at: number, get: (at: number) => number) => [get(at), get(at + 4), get(at + 8)] as const;
    return {
      grids: Array.from({ length: gridCount }, (_, i) => {
        const at = grids + kSkinGridBytes * i;
        return {
          bone: view.getUint32(at, true),
          origin: triple(at + 4, (place) => view.getFloat32(place, true)),
          cellM: view.getFloat32(at + 16, true),
          dims: triple(at + 20, (place) => view.getUint32(place, true)),
          first: view.getUint32(at + 32, true),
        };
      }),
      nodes: module.copy(nodes, 4 * count),
      thicknessM,
    };
  }

  /** Writes the points of a character's hair, in world space: x, y, z each. After an error `out` stays as it is. */
  pointsOf(index: number, out: Float32Array): void {
    const { module } = this;
    const at = module.allocate(4 * out.length);
    const error = module.call("hairnet_shown_points", this.handle, index, at, 0, out.length / 3);
    if (error === 0) out.set(module.floats(at, out.length));
    module.call("free", at);
  }

  /**
   * Writes the displacements of the lattice's nodes from rest, head space, m: x, y, z each. After an error `out` stays
   * as it is.
   */
  nodesOf(index: number, out: Float32Array): void {
    const { module } = this;
    const at = module.allocate(4 * out.length);
    const error = module.call("hairnet_shown_nodes", this.handle, index, at, out.length / 3);
    if (error === 0) out.set(module.floats(at, out.length));
    module.call("free", at);
  }

  /** The modes whose weighted sum is the lattice of a character; undefined where its lattice has no basis of modes. */
  modesOf(index: number): MovedModes | undefined {
    const { module } = this;
    const at = module.struct(kShownBytes, (place) =>
      module.demand("hairnet_get_shown", this.handle, index, place, 1),
    ).byteOffset;
    const shown = this.#one.at(at);
    if (shown.basis === 0) return undefined;
    const basis = this.#bases.get(shown.basis) ?? new ModuleBasis(this, shown.modeCount);
    this.#bases.set(shown.basis, basis);
    basis.index = index;
    return { basis, coefficients: shown.coefficients };
  }

  free(): void {
    this.#shown.free();
  }
}

class ModuleBasis implements Basis {
  /** A character that has this basis: the module finds the basis by a character. */
  index = 0;

  constructor(
    private readonly scene: Scene,
    readonly modeCount: number,
  ) {}

  texels(): Float32Array<ArrayBuffer> {
    return this.scene.module.allFloats("hairnet_shown_modes", this.scene.handle, this.index);
  }
}

/**
 * A view of one `hairnet_shown` after the other, so that pictures of crowds leave no garbage. The getters have the
 * names of the fields, which client/hairnet.h explains.
 */
export class Shown {
  /** The address of the viewed `hairnet_shown` in the module's memory. */
  private place = 0;
  #view: DataView;

  constructor(private readonly module: Instance) {
    this.#view = module.view();
  }

  at(place: number): this {
    this.place = place;
    this.#view = this.module.view();
    return this;
  }

  get member(): number {
    return this.#u32(At.member);
  }
  get own(): number {
    return this.#u32(At.own);
  }
  get sessionLow(): number {
    return this.#u32(At.session);
  }
  get sessionHigh(): number {
    return this.#u32(At.session + 4);
  }
  get ownerCharacter(): number {
    return this.#u32(At.ownerCharacter);
  }
  get level(): LevelIndex {
    return this.#u32(At.level);
  }
  get hasPose(): boolean {
    return this.#u32(At.hasPose) !== 0;
  }
  get hasHair(): boolean {
    return this.#u32(At.hasHair) !== 0;
  }
  get moves(): boolean {
    return this.#u32(At.moves) !== 0;
  }
  get delayS(): number {
    return this.#view.getFloat64(this.place + At.delayS, true);
  }
  get appearance(): Appearance {
    const at = At.appearance;
    const roughness = this.#view.getFloat32(this.place + at + 12, true);
    // A float holds no exact 255th: rounding to one gives the number that programs compute as `byte / 255`.
    return {
      hairRoot: this.#u32(at),
      hairTip: this.#u32(at + 4),
      skin: this.#u32(at + 8),
      roughness: Math.round(255 * roughness) / 255,
    };
  }
  get groomKey(): string {
    const hash = this.module.copy(this.#u32(At.hash), kHashBytes);
    return Array.from(hash, (byte) => byte.toString(16).padStart(2, "0")).join("");
  }
  get tag(): Uint8Array {
    return this.module.copy(this.#u32(At.tag), this.#u32(At.tagSize));
  }
  get error(): string {
    return this.module.text(this.#u32(At.error));
  }
  readPose(out: Float64Array): void {
    const memory = this.module.doubleMemory();
    const begin = (this.place + At.pose) / 8;
    for (let i = 0; i < kPoseNumbers; ++i) out[i] = memory[begin + i];
  }
  /** The module's number of the basis of modes, which characters with one groom share; 0: the lattice has no modes. */
  get basis(): number {
    return this.#u32(At.basis);
  }
  get modeCount(): number {
    return this.#u32(At.modeCount);
  }
  /** The amounts of the groom's modes, m, as a copy that outlives this view. */
  get coefficients(): Float32Array {
    return this.module.floats(this.#u32(At.coefficients), this.#u32(At.coefficientCount)).slice();
  }
  /**
   * The place of the lattice's first node, head space, m. This view and the two below are valid until the next call.
   */
  get origin(): Float32Array {
    return this.module.floats(this.place + At.origin, 3);
  }
  get spacing(): Float32Array {
    return this.module.floats(this.place + At.spacing, 3);
  }
  get counts(): Uint32Array {
    return this.module.words(this.place + At.counts, 3);
  }

  #u32(at: number): number {
    return this.#view.getUint32(this.place + at, true);
  }
}

/** A lattice of the module. Its nodes are computed when a caller wants them. */
export class ModuleLattice implements MovedLattice, ShownLattice {
  readonly lattice: MovedLattice["lattice"];
  readonly module: Instance;
  /** The index of the character in the last `Scene.read`. */
  index = 0;
  /** The displacements of the nodes. The array is made at its first use, and reused in later pictures. */
  #grid: Float32Array | null = null;
  /** `#grid` has the displacements of this picture. */
  #isComputed = false;

  constructor(
    private readonly of: Scene,
    shown: Shown,
    /** The module's number of the basis of its modes; 0: it has none. */
    readonly basis: number,
  ) {
    const [x, y, z] = shown.counts;
    this.lattice = { origin: shown.origin.slice(), spacing: shown.spacing.slice(), dims: [x, y, z] };
    this.module = of.module;
  }

  /** Whether this object can show the character: its lattice has the same basis, or without one the same nodes. */
  fits(shown: Shown): boolean {
    return (
      shown.basis === this.basis &&
      (this.basis > 0 ||
        (shown.counts.every((count, axis) => count === this.lattice.dims[axis]) &&
          shown.origin.every((x, axis) => x === this.lattice.origin[axis]) &&
          shown.spacing.every((x, axis) => x === this.lattice.spacing[axis])))
    );
  }

  /** Takes the index of the character in a new `Scene.read`. The nodes of the reading before are out of date then. */
  show(index: number): void {
    this.index = index;
    this.#isComputed = false;
  }

  get shown(): ShownLattice {
    return this;
  }

  get scene(): number {
    return this.of.handle;
  }

  get modes(): MovedModes | undefined {
    return this.of.modesOf(this.index);
  }

  get grid(): Float32Array {
    this.#grid ??= new Float32Array(3 * nodeCount(this.lattice));
    if (!this.#isComputed) this.of.nodesOf(this.index, this.#grid);
    this.#isComputed = true;
    return this.#grid;
  }
}
