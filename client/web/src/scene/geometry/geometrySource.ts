import type { Groom } from "../../hair/groom";
import type { RestTangents } from "../../hair/restTangents";
import type { OcclusionGrid } from "./occlusionGrid";

/** What the parts of a geometry are made of. */
export interface GeometrySource {
  readonly groom: Groom;
  readonly occlusion: OcclusionGrid;
  /** delta of every groom point */
  readonly blend: Float32Array;
  /** how hair goes on at each */
  readonly rest: RestTangents;
}
