import type { Cloth, Colour, Thread } from "../../hair/groom";
import type { GeometrySource } from "./geometrySource";
import type { MeshBuilder } from "./meshBuilder";
import { vertexNormals } from "./vertexNormals";

/** Adds threads, then cloths. */
export function addFabric(source: GeometrySource, mesh: MeshBuilder): void {
  for (const thread of source.groom.threads) if (thread.radiusM > 0) addThread(source, thread, mesh);
  for (const cloth of source.groom.cloths) addCloth(source, cloth, mesh);
}

function addThread(source: GeometrySource, thread: Thread, mesh: MeshBuilder): void {
  const { direction } = source.rest;
  for (let p = thread.points.begin; p < thread.points.end; ++p) {
    const here = mesh.vertexCount;
    for (const side of [-1, 1]) addVertex(source, p, direction, p, thread.colour, 1, side * thread.radiusM, mesh);
    if (p > thread.points.begin) mesh.triangles.push(here - 2, here - 1, here, here, here - 1, here + 1);
  }
}

function addCloth(source: GeometrySource, cloth: Cloth, mesh: MeshBuilder): void {
  const first = mesh.vertexCount;
  const { begin, end } = cloth.points;
  const triangles = cloth.triangles.map((corner) => corner - begin);
  const normals = vertexNormals(source.groom.points.subarray(3 * begin, 3 * end), triangles);
  for (const corner of triangles) mesh.triangles.push(first + corner);
  for (let p = begin; p < end; ++p) addVertex(source, p, normals, p - begin, cloth.colour, cloth.opacity, 0, mesh);
}

const left = new Float32Array(6);

function addVertex(
  { groom, occlusion, blend, rest }: GeometrySource,
  point: number,
  directions: Float32Array,
  at: number,
  colour: Colour,
  opacity: number,
  cord: number,
  mesh: MeshBuilder,
): void {
  const x = groom.points[3 * point];
  const y = groom.points[3 * point + 1];
  const z = groom.points[3 * point + 2];
  occlusion.at(x, y, z, left);
  mesh.add(
    x,
    y,
    z,
    blend[point],
    directions[3 * at],
    directions[3 * at + 1],
    directions[3 * at + 2],
    rest.blendSlope[point],
    left,
    0,
    0,
  );
  mesh.addExtra(colour[0], colour[1], colour[2], opacity, cord);
}
