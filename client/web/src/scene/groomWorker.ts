import type { Groom } from "../hair/groom";
import { buffersOf } from "./geometry/groomGeometry";
import { makeGroomGeometry } from "./geometry/makeGroomGeometry";

/** Asked for a groom's geometry, answers with it, or with what went wrong. */
self.onmessage = ({ data }: MessageEvent<{ id: number; groom: Groom }>) => {
  const { id, groom } = data;
  try {
    const geometry = makeGroomGeometry(groom);
    self.postMessage({ id, geometry }, { transfer: buffersOf(geometry) });
  } catch (fault) {
    self.postMessage({ id, fault: String(fault) });
  }
};
