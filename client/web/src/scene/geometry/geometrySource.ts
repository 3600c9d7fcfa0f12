import type { Groom } from "../../hair/groom";
import type { RestTangents } from "../../hair/restTangents";
import type { OcclusionGrid } from "./occlusionGrid";

/** The inputs of all parts of a geometry. */
export interface GeometrySource {
  readonly groom: Groom;
  readonly occlusion: OcclusionGrid;
  /** delta of every groom point */
  readonly blend: Float32Array;
  /** the hair's direction at each point */
  readonly rest: RestTangents;
}
