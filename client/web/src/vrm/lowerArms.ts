import type { VRM } from "@pixiv/three-vrm";
import { type Quaternion, Vector3 } from "three";

/** How far lowered arms are below the horizontal: 69 degrees. */
const kBelowHorizontalRad = 1.2;
/** How far the forearms are bent forward. */
const kElbowRad = 0.25;

/**
 * Turns the arms of a model from its rest, with arms spread, to its sides. Works from the place of the joints, so it is
 * right for both versions of VRM and for models whose rest has lowered arms. Call `vrm.update` after it.
 */
export function lowerArms(vrm: VRM, belowHorizontalRad = kBelowHorizontalRad): void {
  const { humanoid } = vrm;
  // The normalized bones have the axes of the model: those of VRM 0 look along -Z.
  const forward = vrm.meta.metaVersion === "0" ? -1 : 1;
  for (const side of ["left", "right"] as const) {
    const upper = humanoid.getNormalizedBoneNode(`${side}UpperArm`);
    const lower = humanoid.getNormalizedBoneNode(`${side}LowerArm`);
    const hand = humanoid.getNormalizedBoneNode(`${side}Hand`);
    if (!upper || !lower) continue;
    const out = Math.sign(lower.position.x) * Math.cos(belowHorizontalRad);
    const down = new Vector3(out, -Math.sin(belowHorizontalRad), 0);
    turn(upper.quaternion, lower.position, down);
    if (!hand) continue;
    const ahead = down.setZ(forward * Math.tan(kElbowRad)).applyQuaternion(upper.quaternion.clone().invert());
    turn(lower.quaternion, hand.position, ahead);
  }
}

/** Sets the rotation that turns the direction `from` into the direction `to`. */
function turn(rotation: Quaternion, from: Vector3, to: Vector3): void {
  rotation.setFromUnitVectors(from.clone().normalize(), to.clone().normalize());
}
