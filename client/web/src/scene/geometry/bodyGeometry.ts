import type { GeometrySource } from "./groomGeometry";
import type { MeshBuilder } from "./meshBuilder";
import { Scalp } from "./scalp";

const kSwungAway = 0.6;
const kScattered = 0.2;

export function addBody({ groom, light }: GeometrySource, mesh: MeshBuilder): void {
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
    // Its own cell holds the skin itself: look from a little outside.
    const out = 1.5 * light.cellM;
    light.at(x + out * nx, y + out * ny, z + out * nz, left, [nx, ny, nz]);
    const share = boneWeights.subarray(5 * v, 5 * v + 5);
    // Hair at rest shades the head always, if softly, but back and shoulders only until it is swung away.
    const lit = kSwungAway + share[0] * (kScattered - kSwungAway);
    for (let side = 0; side < 6; ++side) left[side] += lit * (1 - left[side]);
    mesh.add(x, y, z, 0, nx, ny, nz, scalp.at(x, y, z), left, share[4], 0);
    mesh.addExtra(share[0], share[1], share[2], share[3]);
  }
  const at = mesh.triangles.length;
  mesh.triangles.extend(triangles.length).set(triangles, at);
}

/** Unit, 3 a vertex, each triangle by its area; up where there is none. */
export function vertexNormals(vertices: Float32Array, triangles: Uint32Array): Float32Array {
  const normals = new Float32Array(vertices.length);
  for (let t = 0; t + 2 < triangles.length; t += 3) {
    const a = 3 * triangles[t];
    const b = 3 * triangles[t + 1];
    const c = 3 * triangles[t + 2];
    const ux = vertices[b] - vertices[a];
    const uy = vertices[b + 1] - vertices[a + 1];
    const uz = vertices[b + 2] - vertices[a + 2];
    const vx = vertices[c] - vertices[a];
    const vy = vertices[c + 1] - vertices[a + 1];
    const vz = vertices[c + 2] - vertices[a + 2];
    const nx = uy * vz - uz * vy;
    const ny = uz * vx - ux * vz;
    const nz = ux * vy - uy * vx;
    for (const corner of [a, b, c]) {
      normals[corner] += nx;
      normals[corner + 1] += ny;
      normals[corner + 2] += nz;
    }
  }
  for (let i = 0; i < normals.length; i += 3) {
    const length = Math.hypot(normals[i], normals[i + 1], normals[i + 2]);
    if (length > 1e-12) {
      normals[i] /= length;
      normals[i + 1] /= length;
      normals[i + 2] /= length;
    } else {
      normals[i] = normals[i + 2] = 0;
      normals[i + 1] = 1;
    }
  }
  return normals;
}
