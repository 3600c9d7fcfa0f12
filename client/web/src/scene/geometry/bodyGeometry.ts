import { kScattered, kSwungAway } from "../../generated/constants";
import type { GeometrySource } from "./geometrySource";
import type { MeshBuilder } from "./meshBuilder";
import { Scalp } from "./scalp";
import { vertexNormals } from "./vertexNormals";

export function addBody({ groom, occlusion }: GeometrySource, mesh: MeshBuilder): void {
  const scalp = new Scalp(groom);
  const { vertices, triangles, boneWeights } = groom.body;
  const normals = vertexNormals(vertices, triangles);
  const left = new Float32Array(6);
  for (let v = 0; v < vertices.length / 3; ++v) {
    const x = vertices[3 * v];
    const y = vertices[3 * v + 1];
    const z = vertices[3 * v + 2];
    const nx = normals[3 * v];
    const ny = normals[3 * v + 1];
    const nz = normals[3 * v + 2];
    // A point's own cell contains the skin itself: sample a little outside.
    const out = 1.5 * occlusion.cellM;
    occlusion.at(x + out * nx, y + out * ny, z + out * nz, left, [nx, ny, nz]);
    const share = boneWeights.subarray(5 * v, 5 * v + 5);
    // Hair at rest always shades the head, softly; it shades back and shoulders only until it swings away.
    const lit = kSwungAway + share[0] * (kScattered - kSwungAway);
    for (let side = 0; side < 6; ++side) left[side] += lit * (1 - left[side]);
    mesh.add(x, y, z, 0, nx, ny, nz, scalp.at(x, y, z), left, share[4], 0);
    mesh.addExtra(share[0], share[1], share[2], share[3]);
  }
  const at = mesh.triangles.length;
  mesh.triangles.extend(triangles.length).set(triangles, at);
}
