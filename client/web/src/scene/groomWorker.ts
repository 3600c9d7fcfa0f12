import type { Groom } from "../hair/groom";
import { coarseGroom } from "./geometry/coarseGroom";
import { buffersOf } from "./geometry/groomGeometry";
import { makeGroomGeometry } from "./geometry/makeGroomGeometry";

/** Those that were answered with a coarse geometry. */
const grooms = new Map<number, Groom>();

/**
 * Receives a groom, and answers with a coarse geometry if the whole one takes long, or with the whole one, or with the
 * error. After a coarse one the same `id` without a groom asks for the whole one.
 */
self.onmessage = ({ data }: MessageEvent<{ id: number; groom?: Groom }>) => {
  const { id } = data;
  const groom = data.groom ?? grooms.get(id)!;
  try {
    const few = data.groom ? coarseGroom(groom) : null;
    if (few) {
      const coarse = makeGroomGeometry(few);
      grooms.set(id, groom);
      self.postMessage({ id, coarse }, { transfer: buffersOf(coarse) });
      return;
    }
    grooms.delete(id);
    const geometry = makeGroomGeometry(groom);
    self.postMessage({ id, geometry }, { transfer: buffersOf(geometry) });
  } catch (fault) {
    self.postMessage({ id, fault: String(fault) });
  }
};
