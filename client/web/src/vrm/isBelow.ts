import type { Object3D } from "three";

/** Whether `object` is `ancestor` or one of its descendants. */
export function isBelow(object: Object3D | null, ancestor: Object3D | null): boolean {
  for (let at = object; at; at = at.parent) if (at === ancestor) return true;
  return false;
}
