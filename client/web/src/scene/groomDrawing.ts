import {
  Box3,
  BufferAttribute,
  DataTexture,
  FloatType,
  Float16BufferAttribute,
  InstancedBufferGeometry,
  Mesh,
  RGBAFormat,
  RGFormat,
  Vector3,
  type Group,
  type IUniform,
  type RawShaderMaterial,
} from "three";
import { kDensityStrandsMax, kFollowHairsMax, kPointRow } from "../generated/constants";
import type { DrawDetail } from "./drawDetail";
import { buffersOf, type Attributes, type GroomGeometry, type MeshArrays } from "./geometry/groomGeometry";
import { SkinTexture } from "./skinTexture";
import { makeMaterial, makeShadowMaterial, type HairPart, type SceneUniforms } from "./hairMaterials";

/** One character to draw, in the order of its records. */
export interface Drawn {
  readonly detail: DrawDetail;
  /** The index of a list of strands: each list has another tolerance (`GroomDrawing.listFor`). */
  readonly list: number;
}

/** Counts of the last drawing. */
export interface DrawCounts {
  drawCalls: number;
  strands: number;
  vertices: number;
}

/** Sorts for `GroomDrawing.show`: characters with one list are adjacent. */
export function inDrawingOrder(a: Drawn, b: Drawn): number {
  return a.list - b.list || b.detail.strandShare - a.detail.strandShare;
}

/** All characters of one groom: a draw call for each part of it, and one for each list of its strands. */
export class GroomDrawing {
  readonly strandCount: number;
  readonly strandWidthM: number;
  readonly radiusM: number;
  /** The bytes of all arrays of the geometry. */
  readonly bytes: number;
  /** The strands' points for `StrandDeformPass`: rows of kPointRow. */
  readonly restPoints: DataTexture;
  readonly restArcs: DataTexture;
  /** Boxes that contain the points of the resting strands, and their roots. Head space, m. */
  readonly strandBox = new Box3();
  readonly rootBox = new Box3();
  /** The geometry, whose arrays the draw calls share. */
  readonly #geometry: GroomGeometry;
  /** The strands, a mesh for each list of the geometry (`SimplifiedStrands`). */
  readonly #strands: Part[];
  readonly #cards: Part | null;
  readonly #fabric: Part | null;
  readonly #body: Part | null;
  /** All parts that the groom has. */
  readonly #parts: Part[];

  /**
   * The meshes become children of `group`. `adapt` gets each material, which it may change. `castShadow`: the meshes
   * are drawn into shadow maps, too. `skin`: the skin that hair is kept out of; the caller owns it.
   */
  constructor(
    geometry: GroomGeometry,
    private readonly group: Group,
    uniforms: SceneUniforms,
    adapt: (material: RawShaderMaterial, part: HairPart) => void,
    castShadow = false,
    readonly skin: SkinTexture = new SkinTexture(),
  ) {
    this.#geometry = geometry;
    this.strandCount = geometry.strandCount;
    this.strandWidthM = geometry.strandWidthM;
    this.radiusM = geometry.radiusM;
    const make = (
      part: HairPart,
      attributes: BufferAttributes,
      triangles: Uint32Array,
      own: Record<string, IUniform>,
    ) => {
      const material = makeMaterial(part, uniforms, own);
      adapt(material, part);
      const made = new Part(part, attributes, triangles, material, uniforms);
      if (castShadow) made.castShadow(part, uniforms);
      return made;
    };
    const whole = (part: HairPart, { attributes, triangles }: MeshArrays, own: Record<string, IUniform> = {}) =>
      triangles.length > 0 ? make(part, bufferAttributes(attributes), triangles, own) : null;
    this.#body = whole("body", geometry.body);
    this.#fabric = whole("fabric", geometry.fabric, skin.uniforms);
    this.#cards = whole("card", geometry.cards, skin.uniforms);
    const { strands: points } = geometry;
    const rows = points.rest.length / 4 / kPointRow;
    this.restPoints = new DataTexture(points.rest, kPointRow, rows, RGBAFormat, FloatType);
    this.restArcs = new DataTexture(points.arc, kPointRow, rows, RGFormat, FloatType);
    this.restPoints.needsUpdate = this.restArcs.needsUpdate = true;
    const point = new Vector3();
    for (let p = 0; p < points.pointEnd[geometry.strandCount]; ++p) {
      this.strandBox.expandByPoint(point.fromArray(points.rest, 4 * p));
      // A point with no length of strand before it is a root.
      if (points.arc[2 * p] === 0) this.rootBox.expandByPoint(point);
    }
    const strands = bufferAttributes(points.attributes);
    const strandCount = { value: Math.max(geometry.strandCount, 1) };
    this.#strands = points.lists.map((list) =>
      make("strand", strands, list.triangles, { strand_count: strandCount, rest_points: { value: this.restPoints } }),
    );
    const parts = [this.#body, this.#fabric, this.#cards, ...this.#strands];
    this.#parts = parts.filter((part) => part !== null);
    for (const part of this.#parts) group.add(part.mesh);
    this.bytes = buffersOf(geometry).reduce((sum, { byteLength }) => sum + byteLength, 0);
  }

  /** The list of strands for a tolerance: the coarsest one within it. */
  listFor(toleranceM: number): number {
    let best = 0;
    this.#geometry.strands.lists.forEach((list, n) => {
      if (list.toleranceM <= toleranceM) best = n;
    });
    return best;
  }

  /** The number of drawn strands for the share. */
  strandsOf({ detail }: Drawn): number {
    return Math.min(this.strandCount, Math.ceil(detail.strandShare * this.strandCount));
  }

  /** The strands of one character that stand for all of its strands in its grid of density. */
  densityStrandsOf(drawn: Drawn): number {
    return Math.min(this.strandsOf(drawn), kDensityStrandsMax);
  }

  /** The points of the first `strands` strands. */
  pointsOf(strands: number): number {
    return this.#geometry.strands.pointEnd[strands];
  }

  /** Whether the last `show` draws cards: they need their texture. */
  get showsCards(): boolean {
    return this.#cards?.mesh.visible === true;
  }

  /** Rows of kPointRow points in the strands of one character. */
  pointRowsOf(drawn: Drawn): number {
    return Math.ceil(this.#geometry.strands.pointEnd[this.strandsOf(drawn)] / kPointRow);
  }

  /**
   * Draws characters with records from `first` on, in that order (`inDrawingOrder`). Without characters it draws
   * nothing.
   */
  show(shown: readonly Drawn[], first: number, counts: DrawCounts): void {
    for (const part of this.#parts) part.hide();
    if (shown.length === 0) return;
    this.#body?.show(first, shown.length, 1, counts);
    this.#fabric?.show(first, shown.length, 1, counts);
    this.#cards?.show(first, shown.length, 1, counts);
    // Each pass draws the characters with one list, which are adjacent. The draw call has as many strands and follow
    // hairs as the character with most; the shaders leave out what others have less.
    for (let begin = 0; begin < shown.length; ) {
      let end = begin;
      let strands = 0;
      let followHairs = 0;
      const { list } = shown[begin];
      for (; end < shown.length && shown[end].list === list; ++end) {
        strands = Math.max(strands, this.strandsOf(shown[end]));
        followHairs = Math.max(followHairs, shown[end].detail.followHairCount);
      }
      if (strands > 0) {
        // A copy is the strand itself or one of its follow hairs.
        const copies = 1 + Math.ceil(Math.min(Math.max(followHairs, 0), kFollowHairsMax));
        const part = this.#strands[list];
        part.mesh.geometry.setDrawRange(0, this.#geometry.strands.lists[list].end[strands]);
        part.show(first + begin, end - begin, copies, counts);
        counts.strands += strands * copies * (end - begin);
      }
      begin = end;
    }
  }

  dispose(): void {
    for (const part of this.#parts) {
      this.group.remove(part.mesh);
      part.dispose();
    }
    this.restPoints.dispose();
    this.restArcs.dispose();
  }
}

type BufferAttributes = Record<string, BufferAttribute>;

/** Makes GPU buffers, which all lists of strands share. 16-bit arrays are half floats, and bytes are shares of 255. */
function bufferAttributes(attributes: Attributes): BufferAttributes {
  const made: BufferAttributes = {};
  for (const [name, { array, size }] of Object.entries(attributes))
    made[name] =
      array instanceof Uint16Array
        ? new Float16BufferAttribute(array, size)
        : new BufferAttribute(array, size, array instanceof Uint8Array);
  return made;
}

/** The order in which three.js draws the parts of all grooms (`renderOrder`). */
const kOrder: Record<HairPart, number> = { body: 0, fabric: 1, card: 2, strand: 3 };

/** A mesh whose instances are characters, or characters' strands and their follow hairs. */
class Part {
  readonly mesh: Mesh<InstancedBufferGeometry, RawShaderMaterial>;

  constructor(
    part: HairPart,
    attributes: BufferAttributes,
    triangles: Uint32Array,
    material: RawShaderMaterial,
    uniforms: SceneUniforms,
  ) {
    const geometry = new InstancedBufferGeometry();
    for (const [name, attribute] of Object.entries(attributes)) geometry.setAttribute(name, attribute);
    geometry.setIndex(new BufferAttribute(triangles, 1));
    geometry.instanceCount = 0;
    this.mesh = new Mesh(geometry, material);
    this.mesh.name = material.name;
    // HairScene leaves out characters that no view sees; three.js knows no bounds of instances that shaders move.
    this.mesh.frustumCulled = false;
    this.mesh.matrixAutoUpdate = false;
    this.mesh.renderOrder = kOrder[part];
    // Shaders move the hair, so a ray of three.js would meet it only where it lies at rest.
    this.mesh.raycast = () => {};
    this.mesh.visible = false;
    this.mesh.onBeforeRender = (renderer) => uniforms.setTarget(renderer);
  }

  /** Each character's strands are drawn once into a shadow map, without follow hairs. */
  castShadow(part: HairPart, uniforms: SceneUniforms): void {
    const { mesh } = this;
    const material = makeShadowMaterial(part, mesh.material);
    // three.js draws shadow maps with the same geometry. The count of instances is lowered for the map alone.
    let instances = 0;
    mesh.castShadow = true;
    mesh.customDepthMaterial = mesh.customDistanceMaterial = material;
    mesh.onBeforeShadow = (renderer) => {
      uniforms.setShadowMap(renderer);
      instances = mesh.geometry.instanceCount;
      mesh.geometry.instanceCount = instances / mesh.material.uniforms.copies.value;
    };
    mesh.onAfterShadow = () => {
      mesh.geometry.instanceCount = instances;
    };
  }

  /** Draws this many characters, whose records begin at `firstRecord`. `copies`: instances for each character. */
  show(firstRecord: number, characters: number, copies: number, counts: DrawCounts): void {
    const { geometry, material } = this.mesh;
    geometry.instanceCount = characters * copies;
    material.uniforms.first_record.value = firstRecord;
    material.uniforms.copies.value = copies;
    this.mesh.visible = true;
    const indices = Math.min(geometry.drawRange.count, geometry.index?.count ?? 0);
    counts.drawCalls += 1;
    counts.vertices += indices * characters * copies;
  }

  hide(): void {
    this.mesh.visible = false;
  }

  dispose(): void {
    this.mesh.geometry.dispose();
    this.mesh.material.dispose();
    this.mesh.customDepthMaterial?.dispose();
  }
}
