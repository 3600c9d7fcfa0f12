import { StandardMaterial } from "@babylonjs/core/Materials/standardMaterial";
import { Color3 } from "@babylonjs/core/Maths/math.color";
import { Quaternion } from "@babylonjs/core/Maths/math.vector";
import { LinesMesh } from "@babylonjs/core/Meshes/linesMesh";
import { Mesh } from "@babylonjs/core/Meshes/mesh";
import { VertexData } from "@babylonjs/core/Meshes/mesh.vertexData";
import type { Scene } from "@babylonjs/core/scene";
import type { Groom, Member } from "hairnet-client";

/** At most this many strands are drawn, evenly chosen from all. */
const kStrandsMax = 3000;
/** The colour of the hair: red, green and blue, 0 to 1. */
const kBrown = [0.45, 0.26, 0.13];

/** One member's hair as lines, and its bust. */
export class MemberHair {
  readonly #hair: LinesMesh;
  readonly #bust: Mesh;

  constructor(groom: Groom, scene: Scene) {
    this.#hair = new LinesMesh("hair", scene, null, null, false, true);
    // Babylon.js knows where the points are now, and would leave out hair that has moved into the view later.
    this.#hair.alwaysSelectAsActiveMesh = true;
    Object.assign(new VertexData(), linesOf(groom)).applyToMesh(this.#hair, true);
    this.#bust = new Mesh("bust", scene);
    this.#bust.rotationQuaternion = Quaternion.Identity();
    const { vertices: positions, triangles: indices } = groom.body;
    const normals: number[] = [];
    VertexData.ComputeNormals(positions, indices, normals, { useRightHandedSystem: true });
    Object.assign(new VertexData(), { positions, indices, normals }).applyToMesh(this.#bust);
    const skin = new StandardMaterial("skin", scene);
    skin.diffuseColor = new Color3(0.75, 0.52, 0.42);
    skin.specularColor = Color3.Black();
    skin.backFaceCulling = false;
    this.#bust.material = skin;
  }

  /** Moves the hair to the member's last sample. */
  update(member: Member): void {
    if (!member.pose) return;
    this.#hair.updateVerticesData("position", member.points());
    // The first bone of a pose is the head. The whole bust moves with it here.
    const [x, y, z, w, ...head] = member.pose;
    this.#bust.rotationQuaternion?.set(x, y, z, w);
    this.#bust.position.fromArray(head);
  }

  dispose(): void {
    this.#hair.dispose(false, true);
    this.#bust.dispose(false, true);
  }
}

/**
 * Some of the strands as lines, brown and darker at the root. Each has its own shade, so that one can tell them apart.
 */
function linesOf({ points: positions, pointCount, strandBegin, strandCount }: Groom): Partial<VertexData> {
  const colors = new Float32Array(4 * pointCount).fill(1);
  const indices: number[] = [];
  for (let s = 0; s < strandCount; s += Math.ceil(strandCount / kStrandsMax)) {
    // Multiples of 0.618 modulo 1 are spread evenly, so neighbours differ.
    const shade = 0.7 + 0.6 * ((s * 0.618) % 1);
    const [first, end] = strandBegin.subarray(s, s + 2);
    for (let i = first; i < end; ++i) {
      const light = shade * (0.5 + (0.5 * (i - first)) / (end - first - 1));
      colors.set(
        kBrown.map((part) => light * part),
        4 * i,
      );
      if (i > first) indices.push(i - 1, i);
    }
  }
  return { positions, colors, indices };
}
