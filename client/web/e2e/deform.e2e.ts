import deformVert from "../../shaders/deform.vert?raw";
import { afterAll, beforeAll, expect, test } from "vitest";
import { Deformer } from "../src/hair/deform";
import { restTangents } from "../src/hair/restTangents";
import { SkinPush } from "../src/hair/skinPush";
import { rootBlend } from "../src/hair/rootBlend";
import { kLatticeRow, kRecordTexels, kSkinRow } from "../src/generated/constants";
import { writeRecord } from "../src/scene/characterRecords";
import { withIncludes } from "../src/scene/shaders";
import { SkinTexture } from "../src/scene/skinTexture";
import { madeGroom } from "../test/support/madeGroom";
import { fullGrid } from "../test/support/shapes";
import { skinVector } from "../test/support/skinVector";
import { furthest } from "../test/support/vectors";
import { Browser } from "./browser";

const browser = new Browser();
beforeAll(() => browser.start());
afterAll(() => browser.dispose());

const kWithinM = 1e-4;

/** Its displacements are as large as those of hair. */
const geometry = fullGrid([6, 8, 6], 0.07);
geometry.lattice.origin.set([-0.2, -0.3, -0.2]);
const grid = Float32Array.from({ length: 3 * geometry.activeNodes.length }, (_, i) => 0.04 * Math.sin(12.9898 * i));

const { skin, thicknessM, pose } = skinVector();

for (const [kind, push] of [
  ["quadratic", new SkinPush([], thicknessM)],
  ["linear", new SkinPush([], thicknessM)],
  ["quadratic", new SkinPush(skin, thicknessM)],
] as const) {
  const isPushed = push.grids.length > 0;
  const place = isPushed ? "out of the skin" : "in and out of lattices";
  test(`the GPU deforms points as the CPU does: ${kind}, ${place}`, async () => {
    const groom = madeGroom(60, 20);
    // Some points are far outside, where border nodes extrapolate.
    for (let p = 0; p < 30; ++p) groom.points[3 * p] += 0.3;
    const count = groom.points.length / 3;
    const blend = rootBlend(groom);
    const rest = restTangents(groom, blend);
    const expected = { points: new Float32Array(3 * count), tangents: new Float32Array(3 * count) };
    new Deformer(geometry.lattice, groom.points, blend, kind, rest).deform(grid, expected);
    const unpushed = expected.points.slice();
    push.push(pose, groom.points, blend, expected.points);
    expect(furthest(unpushed, expected.points) > 0.01).toBe(isPushed);
    const skinTexture = new SkinTexture();
    skinTexture.fill(push);
    const { skin_nodes, skin_place, skin_dims, skin_thickness } = skinTexture.uniforms;

    const record = new Float32Array(4 * kRecordTexels);
    writeRecord(
      {
        pose,
        hairAlbedo: [0, 0, 0],
        hairTipAlbedo: [0, 0, 0],
        roughness: 0.3,
        skinAlbedo: [0, 0, 0],
        widthM: 1,
        detail: {
          strandShare: 1,
          followHairCount: 0,
          toleranceM: 0,
          quadratic: kind === "quadratic" ? 1 : 0,
          cards: 0,
        },
        strayM: 0,
        size: 1,
        bodyVisible: true,
        lattice: { ...geometry.lattice, firstNode: 0, basis: 0, coefficients: new Float32Array(0), uploadedRow: 0 },
        pointRows: { first: 0, count: 1 },
      },
      record,
    );
    const nodes = new Float32Array(4 * kLatticeRow);
    for (let node = 0; node < grid.length / 3; ++node) nodes.set(grid.subarray(3 * node, 3 * node + 3), 4 * node);
    const points = new Float32Array(4 * count);
    const directions = new Float32Array(4 * count);
    for (let p = 0; p < count; ++p) {
      points.set([...groom.points.subarray(3 * p, 3 * p + 3), blend[p]], 4 * p);
      directions.set([...rest.direction.subarray(3 * p, 3 * p + 3), rest.blendSlope[p]], 4 * p);
    }
    const page = await browser.open("about:blank");
    const read = await page.evaluate(deformOnGpu, {
      vertex: `#version 300 es\n${withIncludes(deformVert)}`,
      fragment: "#version 300 es\nprecision mediump float;\nout vec4 colour;\nvoid main() { colour = vec4(0.0); }",
      points: Array.from(points),
      directions: Array.from(directions),
      record: Array.from(record),
      nodes: Array.from(nodes),
      recordTexels: kRecordTexels,
      latticeRow: kLatticeRow,
      skin: {
        texels: Array.from(skin_nodes.value!.image.data!),
        width: kSkinRow,
        place: Array.from(skin_place.value),
        dims: Array.from(skin_dims.value),
        thickness: skin_thickness.value,
      },
    });
    let furthestM = 0;
    let turned = 0;
    for (let p = 0; p < count; ++p)
      for (let axis = 0; axis < 3; ++axis) {
        furthestM = Math.max(furthestM, Math.abs(read[6 * p + axis] - expected.points[3 * p + axis]));
        turned = Math.max(turned, Math.abs(read[6 * p + 3 + axis] - expected.tangents[3 * p + axis]));
      }
    console.log(`${kind}: points within ${furthestM.toExponential(1)} m, tangents within ${turned.toExponential(1)}`);
    expect(furthestM).toBeLessThan(kWithinM);
    expect(turned).toBeLessThan(1e-3);
    await page.close();
  });
}

interface Work {
  vertex: string;
  fragment: string;
  points: number[];
  directions: number[];
  record: number[];
  nodes: number[];
  recordTexels: number;
  latticeRow: number;
  skin: SkinWork;
}

interface SkinWork {
  texels: number[];
  width: number;
  place: number[];
  dims: number[];
  thickness: number;
}

/** Runs in the browser: returns positions and tangents of all points, 6 numbers each, from transform feedback. */
function deformOnGpu(work: Work): number[] {
  const gl = document.createElement("canvas").getContext("webgl2")!;
  const program = gl.createProgram();
  for (const [kind, text] of [
    [gl.VERTEX_SHADER, work.vertex],
    [gl.FRAGMENT_SHADER, work.fragment],
  ] as const) {
    const made = gl.createShader(kind)!;
    gl.shaderSource(made, text);
    gl.compileShader(made);
    if (!gl.getShaderParameter(made, gl.COMPILE_STATUS)) throw new Error(gl.getShaderInfoLog(made) ?? "");
    gl.attachShader(program, made);
  }
  gl.transformFeedbackVaryings(program, ["position_head", "tangent_head"], gl.INTERLEAVED_ATTRIBS);
  gl.linkProgram(program);
  if (!gl.getProgramParameter(program, gl.LINK_STATUS)) throw new Error(gl.getProgramInfoLog(program) ?? "");
  gl.useProgram(program);
  [work.points, work.directions].forEach((values, location) => {
    gl.bindBuffer(gl.ARRAY_BUFFER, gl.createBuffer());
    gl.bufferData(gl.ARRAY_BUFFER, new Float32Array(values), gl.STATIC_DRAW);
    gl.enableVertexAttribArray(location);
    gl.vertexAttribPointer(location, 4, gl.FLOAT, false, 0, 0);
  });
  const put = (unit: number, name: string, width: number, values: number[]) => {
    gl.activeTexture(gl.TEXTURE0 + unit);
    gl.bindTexture(gl.TEXTURE_2D, gl.createTexture());
    const floats = new Float32Array(values);
    if (name === "lattices") {
      const bits = new Uint32Array(floats.buffer);
      gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA32UI, width, 1, 0, gl.RGBA_INTEGER, gl.UNSIGNED_INT, bits);
    } else gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA32F, width, 1, 0, gl.RGBA, gl.FLOAT, floats);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, gl.NEAREST);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MAG_FILTER, gl.NEAREST);
    gl.uniform1i(gl.getUniformLocation(program, name), unit);
  };
  put(0, "records", work.recordTexels, work.record);
  put(1, "lattices", work.latticeRow, work.nodes);
  gl.activeTexture(gl.TEXTURE2);
  gl.bindTexture(gl.TEXTURE_2D, gl.createTexture());
  const rows = work.skin.texels.length / 4 / work.skin.width;
  const texels = new Uint8Array(work.skin.texels);
  gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA, work.skin.width, rows, 0, gl.RGBA, gl.UNSIGNED_BYTE, texels);
  gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, gl.NEAREST);
  gl.uniform1i(gl.getUniformLocation(program, "skin_nodes"), 2);
  gl.uniform4fv(gl.getUniformLocation(program, "skin_place"), work.skin.place);
  gl.uniform4fv(gl.getUniformLocation(program, "skin_dims"), work.skin.dims);
  gl.uniform1f(gl.getUniformLocation(program, "skin_thickness"), work.skin.thickness);
  const count = work.points.length / 4;
  const out = gl.createBuffer();
  gl.bindBuffer(gl.TRANSFORM_FEEDBACK_BUFFER, out);
  gl.bufferData(gl.TRANSFORM_FEEDBACK_BUFFER, 24 * count, gl.STATIC_READ);
  gl.bindBufferBase(gl.TRANSFORM_FEEDBACK_BUFFER, 0, out);
  gl.enable(gl.RASTERIZER_DISCARD);
  gl.beginTransformFeedback(gl.POINTS);
  gl.drawArrays(gl.POINTS, 0, count);
  gl.endTransformFeedback();
  gl.finish();
  const read = new Float32Array(6 * count);
  gl.bindBuffer(gl.TRANSFORM_FEEDBACK_BUFFER, out);
  gl.getBufferSubData(gl.TRANSFORM_FEEDBACK_BUFFER, 0, read);
  if (gl.getError() !== gl.NO_ERROR) throw new Error("the GPU refuses");
  return Array.from(read);
}
