import { afterAll, beforeAll, expect, test } from "vitest";
import { Deformer } from "../src/hair/deform";
import { rigidPose } from "../src/hair/pose";
import { StrandLengths } from "../src/hair/strandLengths";
import { makeGroomGeometry } from "../src/scene/geometry/makeGroomGeometry";
import { kLatticeRow, kPointRow, kRecordTexels } from "../src/generated/constants";
import { writeRecord } from "../src/scene/characterRecords";
import { shader } from "../src/scene/shaders";
import { madeGroom } from "../test/support/madeGroom";
import { fullGrid } from "../test/support/shapes";
import { Browser } from "./browser";

const browser = new Browser();
beforeAll(() => browser.start());
afterAll(() => browser.dispose());

test("the GPU places points of strands as the CPU does, none further along its strand than at rest", async () => {
  const { strands, strandCount } = makeGroomGeometry(madeGroom(100, 20));
  const count = strands.pointEnd[strandCount];
  const rows = strands.rest.length / 4 / kPointRow;
  const { lattice, activeNodes } = fullGrid([6, 8, 6], 0.07);
  lattice.origin.set([-0.2, -0.3, -0.2]);
  const grid = new Float32Array(3 * activeNodes.length);
  for (let i = 0; i < grid.length; ++i) grid[i] = 0.05 * Math.sin(12.9898 * i);

  const rest = new Float32Array(3 * count);
  const blend = new Float32Array(count);
  for (let p = 0; p < count; ++p) {
    rest.set(strands.rest.subarray(4 * p, 4 * p + 3), 3 * p);
    blend[p] = strands.rest[4 * p + 3];
  }
  const points = new Float32Array(3 * count);
  new Deformer(lattice, rest, blend, "quadratic").deform(grid, { points });
  const deformed = points.slice();
  new StrandLengths(rest, strands.pointEnd).limit(points);

  const record = new Float32Array(4 * kRecordTexels);
  const { origin, spacing, dims } = lattice;
  writeRecord(
    {
      pose: rigidPose(),
      hairAlbedo: [0, 0, 0],
      hairTipAlbedo: [0, 0, 0],
      roughness: 0.3,
      skinAlbedo: [0, 0, 0],
      widthM: 1,
      detail: { strandShare: 1, followHairCount: 0, toleranceM: 0, quadratic: 1, cards: 0 },
      strayM: 0,
      size: 1,
      bodyVisible: true,
      lattice: { origin, spacing, dims, firstNode: 0, basis: 0, coefficients: new Float32Array(0), uploadedRow: 0 },
      pointRows: { first: 1, count: rows },
    },
    record,
  );
  const nodes = new Float32Array(4 * kLatticeRow);
  for (let n = 0; n < activeNodes.length; ++n) nodes.set(grid.subarray(3 * n, 3 * n + 3), 4 * n);

  const page = await browser.open("about:blank");
  const version = "#version 300 es\n";
  const read = await page.evaluate(placeOnGpu, {
    vertex: version + shader("points.vert"),
    passes: ["deform_points.frag", "limit_lengths.frag"].map((name) => version + shader(name)),
    rest: Array.from(strands.rest),
    arc: Array.from(strands.arc),
    record: Array.from(record),
    nodes: Array.from(nodes),
    widths: [kPointRow, kRecordTexels, kLatticeRow],
    rows,
  });
  const placed = new Float32Array(Uint32Array.from(read).buffer);
  let furthest = 0;
  let moved = 0;
  for (let p = 0; p < count; ++p)
    for (let axis = 0; axis < 3; ++axis) {
      furthest = Math.max(furthest, Math.abs(placed[4 * p + axis] - points[3 * p + axis]));
      moved = Math.max(moved, Math.abs(deformed[3 * p + axis] - points[3 * p + axis]));
    }
  console.log(
    `points within ${furthest.toExponential(1)} m, of up to ${moved.toExponential(1)} m that they were moved`,
  );
  expect(moved).toBeGreaterThan(0.01);
  expect(furthest).toBeLessThan(1e-4);
  await page.close();
});

interface Work {
  vertex: string;
  passes: string[];
  rest: number[];
  arc: number[];
  record: number[];
  nodes: number[];
  widths: number[];
  rows: number;
}

/** Runs in the browser: returns the texels of all points, 4 numbers each. The points have the rows from 1 on. */
function placeOnGpu(work: Work): number[] {
  const gl = document.createElement("canvas").getContext("webgl2")!;
  const [pointRow, recordTexels, latticeRow] = work.widths;
  const make = (
    unit: number,
    format: number,
    width: number,
    height: number,
    from: number,
    type: number,
    values: ArrayBufferView | null,
  ) => {
    const texture = gl.createTexture();
    gl.activeTexture(gl.TEXTURE0 + unit);
    gl.bindTexture(gl.TEXTURE_2D, texture);
    gl.texImage2D(gl.TEXTURE_2D, 0, format, width, height, 0, from, type, values);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, gl.NEAREST);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MAG_FILTER, gl.NEAREST);
    return texture;
  };
  make(0, gl.RGBA32F, recordTexels, 1, gl.RGBA, gl.FLOAT, new Float32Array(work.record));
  const bits = new Uint32Array(new Float32Array(work.nodes).buffer);
  make(1, gl.RGBA32UI, latticeRow, 1, gl.RGBA_INTEGER, gl.UNSIGNED_INT, bits);
  make(2, gl.RGBA32F, pointRow, work.rows, gl.RGBA, gl.FLOAT, new Float32Array(work.rest));
  make(3, gl.RG32F, pointRow, work.rows, gl.RG, gl.FLOAT, new Float32Array(work.arc));
  const targets = [4, 5].map((unit) =>
    make(unit, gl.RGBA32UI, pointRow, work.rows + 1, gl.RGBA_INTEGER, gl.UNSIGNED_INT, null),
  );
  gl.bindFramebuffer(gl.FRAMEBUFFER, gl.createFramebuffer());
  gl.viewport(0, 0, pointRow, work.rows + 1);
  work.passes.forEach((fragment, n) => {
    const program = gl.createProgram();
    for (const [kind, text] of [
      [gl.VERTEX_SHADER, work.vertex],
      [gl.FRAGMENT_SHADER, fragment],
    ] as const) {
      const made = gl.createShader(kind)!;
      gl.shaderSource(made, text);
      gl.compileShader(made);
      if (!gl.getShaderParameter(made, gl.COMPILE_STATUS)) throw new Error(gl.getShaderInfoLog(made) ?? "");
      gl.attachShader(program, made);
    }
    gl.linkProgram(program);
    gl.useProgram(program);
    for (const [unit, name] of ["records", "lattices", "rest_points", "rest_arcs", "deformed_points"].entries())
      gl.uniform1i(gl.getUniformLocation(program, name), unit);
    gl.uniform1i(gl.getUniformLocation(program, "first_record"), 0);
    gl.uniform1i(gl.getUniformLocation(program, "target_rows"), work.rows + 1);
    gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.TEXTURE_2D, targets[n], 0);
    gl.drawArraysInstanced(gl.TRIANGLES, 0, 6, 1);
  });
  const read = new Uint32Array(4 * pointRow * work.rows);
  gl.readPixels(0, 1, pointRow, work.rows, gl.RGBA_INTEGER, gl.UNSIGNED_INT, read);
  if (gl.getError() !== gl.NO_ERROR) throw new Error("the GPU refuses");
  return Array.from(read);
}
