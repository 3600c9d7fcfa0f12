import { StandardMaterial } from "@babylonjs/core/Materials/standardMaterial";
import { Color3, Color4 } from "@babylonjs/core/Maths/math.color";
import { Quaternion, Vector3 } from "@babylonjs/core/Maths/math.vector";
import { Mesh } from "@babylonjs/core/Meshes/mesh";
import { VertexData } from "@babylonjs/core/Meshes/mesh.vertexData";
import { CreateLineSystem } from "@babylonjs/core/Meshes/Builders/linesBuilder";
import type { LinesMesh } from "@babylonjs/core/Meshes/linesMesh";
import { TransformNode } from "@babylonjs/core/Meshes/transformNode";
import type { Scene } from "@babylonjs/core/scene";
import { Deformer, type Groom, type LevelGeometry, type Member } from "hairnet-client";

const kStrandsMax = 3000;

/** One member's hair as lines, and its bust. Another engine gets its hair in the same way, from `points`. */
export class MemberHair {
  readonly node: TransformNode;
  readonly #lines: LinesMesh;
  /** head space, m: at rest, and as drawn */
  readonly #rest: Float32Array;
  readonly #points: Float32Array;
  /** of the lattice that the hair follows */
  #deformer: Deformer | null = null;
  #geometry: LevelGeometry | null = null;

  constructor(groom: Groom, scene: Scene) {
    const { begin, count } = groom.strands;
    const every = Math.ceil(count / kStrandsMax);
    const drawn = Array.from({ length: count }, (_, s) => s).filter((s) => s % every === 0);
    this.#rest = Float32Array.from(drawn.flatMap((s) => [...groom.points.subarray(3 * begin[s], 3 * begin[s + 1])]));
    this.#points = this.#rest.slice();
    this.node = new TransformNode("member", scene);
    this.node.rotationQuaternion = Quaternion.Identity();
    const lines = drawn.map((s) =>
      Array.from({ length: begin[s + 1] - begin[s] }, (_, i) => Vector3.FromArray(groom.points, 3 * (begin[s] + i))),
    );
    this.#lines = CreateLineSystem("hair", { lines, colors: lines.map(coloursOf), updatable: true }, scene);
    this.#lines.parent = this.node;
    const bust = new Mesh("bust", scene);
    const data = new VertexData();
    const normals: number[] = [];
    VertexData.ComputeNormals(groom.body.vertices, groom.body.triangles, normals, { useRightHandedSystem: true });
    Object.assign(data, { positions: groom.body.vertices, indices: groom.body.triangles, normals });
    data.applyToMesh(bust);
    const skin = new StandardMaterial("skin", scene);
    skin.diffuseColor = new Color3(0.75, 0.52, 0.42);
    skin.specularColor = Color3.Black();
    skin.backFaceCulling = false;
    bust.material = skin;
    bust.parent = this.node;
  }

  /** Moves the hair to the member's last sample. */
  update({ pose, lattice }: Member): void {
    if (!pose) return;
    this.node.rotationQuaternion?.set(pose[0], pose[1], pose[2], pose[3]);
    this.node.position.set(pose[4], pose[5], pose[6]);
    if (lattice) this.#deformerOf(lattice.geometry).deform(lattice.grid, { points: this.#points });
    else this.#points.set(this.#rest);
    this.#lines.updateVerticesData("position", this.#points);
  }

  dispose(): void {
    this.node.dispose(false, true); // with its meshes and their materials
  }

  #deformerOf(geometry: LevelGeometry): Deformer {
    if (!this.#deformer || this.#geometry !== geometry)
      this.#deformer = new Deformer(geometry.lattice, this.#rest, null, "quadratic");
    this.#geometry = geometry;
    return this.#deformer;
  }
}

/** Brown, darker at the root; each hair has its own shade, so that one can tell them apart. */
function coloursOf(hair: readonly Vector3[], index: number): Color4[] {
  const shade = 0.7 + 0.6 * ((index * 0.618) % 1);
  return hair.map((_, i) => {
    const light = shade * (0.5 + (0.5 * i) / (hair.length - 1));
    return new Color4(0.45 * light, 0.26 * light, 0.13 * light, 1);
  });
}
