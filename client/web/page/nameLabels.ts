import { MathUtils, Vector3, type PerspectiveCamera } from "three";
import { portraitOf, type Size } from "./framing";
import type { Shown } from "./focus";
import { givenName } from "./roomDetails";

/** People further from the camera than this have no label. */
const kFarM = 12;
/** A label is this far above the hair. */
const kAboveHairM = 0.05;
/** Two labels overlap when they are nearer to each other than this in both directions. */
const kWidthPx = 150;
const kHeightPx = 26;
/** The radius of a head with hair, which hides labels behind it, m. */
const kHeadRadiusM = 0.13;

/** Names over heads, as elements that follow them. Screen readers read the list of people instead. */
export class NameLabels {
  /** The labels by member number. */
  readonly #labels = new Map<number, HTMLElement>();

  /** `place`: the element that gets the labels; it lies over the picture. */
  constructor(private readonly place: HTMLElement) {}

  /**
   * Call it after each picture. Of labels that would overlap it shows the nearest, and no label in front of a nearer
   * head. `free`: the part of the `view` that no controls cover, at its left and top.
   */
  update(shown: readonly Shown[], camera: PerspectiveCamera, free: Size, view: Size): void {
    const here = new Set<number>();
    // The places of the labels so far, and the heads so far, from near to far. Both hide labels behind them.
    const taken: { x: number; y: number }[] = [];
    const heads: { x: number; y: number; radius: number }[] = [];
    const toPx = ({ x, y }: Vector3) => ({ x: ((x + 1) / 2) * view.width, y: ((1 - y) / 2) * view.height });
    // How many CSS pixels a metre covers at a distance of 1 m.
    const pxAtOneM = view.height / 2 / Math.tan(MathUtils.degToRad(camera.fov) / 2);
    const eye = camera.getWorldPosition(new Vector3());
    const near = [...shown].sort((a, b) => distance(a, eye) - distance(b, eye));
    for (const one of near) {
      const name = one.member.own ? "You" : givenName(one.member);
      if (!name || !one.character.isReady) continue;
      here.add(one.member.member);
      const label = this.#labelOf(one.member.member);
      if (label.textContent !== name) label.textContent = name;
      const at = one.character.position.clone();
      at.y += portraitOf(one.member.groom, one.character.scale.y).top + kAboveHairM;
      at.project(camera);
      const { x, y } = toPx(at);
      const isHidden = heads.some((head) => Math.hypot(head.x - x, head.y - y) < head.radius);
      const radius = (kHeadRadiusM * one.character.scale.y * pxAtOneM) / Math.max(distance(one, eye), 0.1);
      // A projected z above 1 is behind the camera or beyond its far plane.
      if (at.z <= 1) heads.push({ ...toPx(one.character.position.clone().project(camera)), radius });
      const isFree = x > 0 && x < free.width && y > kHeightPx && y < free.height;
      const overlaps = taken.some((other) => Math.abs(other.x - x) < kWidthPx && Math.abs(other.y - y) < kHeightPx);
      label.hidden = at.z > 1 || !isFree || isHidden || overlaps || distance(one, eye) > kFarM;
      if (label.hidden) continue;
      taken.push({ x, y });
      label.style.transform = `translate(${x.toFixed(1)}px, ${y.toFixed(1)}px) translate(-50%, -100%)`;
    }
    for (const [number, label] of this.#labels) {
      if (here.has(number)) continue;
      label.remove();
      this.#labels.delete(number);
    }
  }

  #labelOf(member: number): HTMLElement {
    let label = this.#labels.get(member);
    if (!label) {
      label = document.createElement("span");
      this.place.append(label);
      this.#labels.set(member, label);
    }
    return label;
  }
}

function distance({ character }: Shown, eye: Vector3): number {
  return character.position.distanceTo(eye);
}
