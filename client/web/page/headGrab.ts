import { Sphere, Vector3 } from "three";
import { kHeadMiddleM } from "./head/headPose";
import type { OwnHead } from "./head/ownHead";
import type { Stage } from "./stage";

/** A press within this distance of the head's middle grabs the head: a head with some hair. */
const kHeadRadiusM = 0.15;

/**
 * Drags on the own head turn it, unless `isTaken` says that something else is dragged. Other drags orbit the camera.
 * Keys move the head while the view has the focus. `isShown`: the user has a head in the room.
 */
export function listenForGrabs(stage: Stage, head: OwnHead, isShown: () => boolean, isTaken: () => boolean): void {
  const { canvas } = stage;
  let pointer: number | null = null;
  canvas.addEventListener(
    "pointerdown",
    (event) => {
      if (event.button !== 0 || isTaken() || !isShown() || !isOnHead(stage, head, event)) return;
      pointer = event.pointerId;
      stage.orbit.enabled = false;
      canvas.setPointerCapture(pointer);
      head.grab();
    },
    // The listener must come before the orbit's own one, which would turn the camera with the same press.
    { capture: true },
  );
  canvas.addEventListener("pointermove", (event) => {
    if (event.pointerId === pointer) head.drag(event.movementX, event.movementY, event.shiftKey, stage.camera);
  });
  const end = (event: PointerEvent) => {
    if (event.pointerId !== pointer) return;
    pointer = null;
    stage.orbit.enabled = true;
    head.release();
  };
  canvas.addEventListener("pointerup", end);
  canvas.addEventListener("pointercancel", end);
  addEventListener("keyup", ({ key }) => head.onKeyUp(key));
  addEventListener("blur", () => head.onKeyUp());
  canvas.addEventListener("keydown", (event) => {
    // With Shift the arrow keys turn the view.
    if (isShown() && !event.shiftKey && head.onKey(event.key)) event.preventDefault();
  });
}

function isOnHead(stage: Stage, head: OwnHead, event: PointerEvent): boolean {
  const middle = head.position.clone().add(new Vector3(0, kHeadMiddleM, 0));
  return stage.rayAt(event).intersectsSphere(new Sphere(middle, kHeadRadiusM));
}
