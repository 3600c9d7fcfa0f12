// A lock of hair that a test takes hold of with the mouse.
import type { Page } from "playwright-core";
import type { PageViewer } from "../page/viewer";

export interface Lock {
  /** The pixel of the page at which the lock is. */
  readonly x: number;
  readonly y: number;
  /** The place of the lock, world, m. */
  readonly place: readonly [number, number, number];
  /** How many pixels a metre at the lock spans. */
  readonly pxPerM: number;
}

/**
 * The lock at the right of the face: among the outermost fifth on that side the point nearest to the camera, as the
 * page last sampled it.
 */
export const lockAt = (page: Page, member: number): Promise<Lock> =>
  page.evaluate((number) => {
    const { room, stage } = (window as unknown as { hairnet: PageViewer }).hairnet;
    const { camera } = stage;
    const one = room!.members.get(number)!;
    const [pose, points] = [one.pose!, one.points()!];
    const beside: { at: number; x: number; y: number; z: number }[] = [];
    for (let at = 0; at < points.length; at += 3) {
      const below = pose[5] - points[at + 1];
      // The lock is beside the face: at most 12 cm below the head joint.
      if (below < 0 || below > 0.12) continue;
      const { x, y, z } = camera.position.clone().fromArray(points, at).project(camera);
      beside.push({ at, x, y, z });
    }
    const middle = camera.position.clone().fromArray(pose, 4).project(camera).x;
    const right = Math.max(...beside.map(({ x }) => x)) - middle;
    const lock = beside.filter(({ x }) => x - middle > 0.8 * right).reduce((a, b) => (b.z < a.z ? b : a));
    const place = camera.position.clone().fromArray(points, lock.at);
    return {
      x: ((lock.x + 1) / 2) * innerWidth,
      y: ((1 - lock.y) / 2) * innerHeight,
      place: place.toArray(),
      pxPerM: 1 / (stage.radPerPx * place.distanceTo(camera.position)),
    };
  }, member);
