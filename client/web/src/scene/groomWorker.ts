import type { Groom } from "../hair/groom";
import { coarseGroom } from "./geometry/coarseGroom";
import { buffersOf } from "./geometry/groomGeometry";
import { makeGroomGeometry } from "./geometry/makeGroomGeometry";

/** Receives a groom, and answers with a coarse geometry if the whole one takes long, then with that or with the error. */
self.onmessage = ({ data }: MessageEvent<{ id: number; groom: Groom }>) => {
  const { id, groom } = data;
  try {
    const few = coarseGroom(groom);
    if (few) {
      const coarse = makeGroomGeometry(few);
      self.postMessage({ id, coarse }, { transfer: buffersOf(coarse) });
    }
    const geometry = makeGroomGeometry(groom);
    self.postMessage({ id, geometry }, { transfer: buffersOf(geometry) });
  } catch (fault) {
    self.postMessage({ id, fault: String(fault) });
  }
};
