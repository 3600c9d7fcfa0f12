import { CapsuleGeometry, Group, Mesh, MeshBasicMaterial, Quaternion, Vector3 } from "three";
import type { Hand } from "../../src/index";

/** three.js makes capsules along +Y. */
const kAxisOfCapsules = new Vector3(0, 1, 0);
/** Shapes with a larger radius or length are not drawn, m: they are no hands, and would hide the people. */
const kRadiusMaxM = 0.15;
const kLengthMaxM = 0.5;
/** Unused geometries are freed when there are more than this. */
const kGeometriesMax = 256;

/** Hands as translucent capsules. */
export class ShownHands extends Group {
  readonly #material = new MeshBasicMaterial({ color: 0xe8ad74, transparent: true, opacity: 0.35, depthWrite: false });
  /** The capsules by "radius length" in whole millimetres, since bent fingers have many lengths. */
  readonly #geometries = new Map<string, CapsuleGeometry>();

  /** Shows these hands, and no others. */
  show(hands: Iterable<Hand>): void {
    let count = 0;
    for (const hand of hands) {
      const rotation = new Quaternion().fromArray(hand.rotation);
      const place = new Vector3().fromArray(hand.position);
      for (const { from, to, radiusM, isInsideOut } of hand.shapes) {
        const middle = new Vector3().fromArray(from);
        const axis = new Vector3().fromArray(to).sub(middle);
        if (isInsideOut || radiusM > kRadiusMaxM || axis.length() > kLengthMaxM) continue;
        const mesh = this.#mesh(count++);
        mesh.geometry = this.#geometry(radiusM, axis.length());
        mesh.position.copy(middle.addScaledVector(axis, 0.5)).applyQuaternion(rotation).add(place);
        mesh.quaternion.setFromUnitVectors(kAxisOfCapsules, axis.normalize()).premultiply(rotation);
      }
    }
    while (this.children.length > count) this.remove(this.children[this.children.length - 1]);
    if (this.#geometries.size > kGeometriesMax) this.#forgetUnused();
  }

  #mesh(n: number): Mesh {
    const mesh = (this.children[n] as Mesh | undefined) ?? new Mesh(undefined, this.#material);
    if (!mesh.parent) this.add(mesh);
    return mesh;
  }

  #geometry(radiusM: number, lengthM: number): CapsuleGeometry {
    const [radius, length] = [Math.max(Math.round(1000 * radiusM), 1), Math.round(1000 * lengthM)];
    const key = `${radius} ${length}`;
    const made = this.#geometries.get(key) ?? new CapsuleGeometry(radius / 1000, length / 1000, 4, 12);
    this.#geometries.set(key, made);
    return made;
  }

  #forgetUnused(): void {
    const used = new Set(this.children.map((mesh) => (mesh as Mesh).geometry));
    for (const [key, geometry] of this.#geometries) {
      if (used.has(geometry)) continue;
      geometry.dispose();
      this.#geometries.delete(key);
    }
  }
}
