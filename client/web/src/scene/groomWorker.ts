import type { Groom } from "../hair/groom";
import { buffersOf } from "./geometry/groomGeometry";
import { makeGroomGeometry } from "./geometry/makeGroomGeometry";

/** Receives a groom, and answers with its geometry or with the error. */
self.onmessage = ({ data }: MessageEvent<{ id: number; groom: Groom }>) => {
  const { id, groom } = data;
  try {
    const geometry = makeGroomGeometry(groom);
    self.postMessage({ id, geometry }, { transfer: buffersOf(geometry) });
  } catch (fault) {
    self.postMessage({ id, fault: String(fault) });
  }
};
