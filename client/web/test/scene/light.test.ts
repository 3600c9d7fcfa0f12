import { describe, expect, test } from "vitest";
import {
  AmbientLight,
  ArrayCamera,
  CubeCamera,
  DirectionalLight,
  Group,
  Fog,
  FogExp2,
  PerspectiveCamera,
  Scene,
  SphericalHarmonics3,
  Texture,
  type Vector2,
  Vector3,
  Vector4,
  WebGLCubeRenderTarget,
  type InstancedBufferGeometry,
  type Mesh,
  type RawShaderMaterial,
  type WebGLRenderer,
} from "three";
import { rigidPose } from "../../src/hair/pose";
import { startClient } from "../../src/module/client";
import { detailFor } from "../../src/scene/drawDetail";
import { addEnvironment } from "../../src/scene/environmentLight";
import { GroomDrawing } from "../../src/scene/groomDrawing";
import { SceneUniforms } from "../../src/scene/hairMaterials";
import { HairScene } from "../../src/scene/hairScene";
import { makeLightRig, sceneLights, studioLights } from "../../src/scene/lightRig";
import { shader } from "../../src/scene/shaders";
import { drawnIn, furtherViews, seenBy, shadowViews, viewsOf } from "../../src/scene/view";
import { geometryOf, strandsFile } from "../support/grooms";

/** The width and height of the drawing buffer, pixels. */
const kPx = 600;

/** Stands for a renderer: it has a drawing buffer of kPx x kPx pixels, draws into `viewport`, and needs no GPU. */
function fakeRenderer(viewport = new Vector4(0, 0, kPx, kPx)): WebGLRenderer {
  return {
    xr: { isPresenting: false },
    outputColorSpace: "srgb",
    getDrawingBufferSize: (out: Vector2) => out.set(kPx, kPx),
    getCurrentViewport: (out: Vector4) => out.copy(viewport),
    getRenderTarget: () => null,
    getContextAttributes: () => ({ antialias: true }),
  } as unknown as WebGLRenderer;
}

/** A square camera of 40 degrees at (x, y, z), which looks at `towards`: by default at the origin. */
function cameraAt(x: number, y: number, z: number, towards = new Vector3()): PerspectiveCamera {
  const camera = new PerspectiveCamera(40, 1, 0.1, 100);
  camera.position.set(x, y, z);
  camera.lookAt(towards);
  camera.updateMatrixWorld();
  return camera;
}

test("a WebGPURenderer is refused in words that say what is needed", () => {
  const source = { sample: () => [] };
  const renderer = { isWebGPURenderer: true } as unknown as WebGLRenderer;
  expect(() => new HairScene(source, renderer)).toThrow(/WebGLRenderer/);
  expect(() => new HairScene(source, renderer)).toThrow(expect.objectContaining({ name: "HairnetError" }));
});

describe("further cameras", () => {
  // `seenBy` and `drawnIn` take the radius, m, of the ball about the head that a view must meet, and the head's scale:
  // 0.5 and 1 here.
  const pose = rigidPose([0, 0, 0, 1], [0, 0, 0]);
  const renderer = fakeRenderer();
  // The main camera turns its back on the character, which is at the origin.
  const away = viewsOf(renderer, cameraAt(0, 0, 3, new Vector3(0, 0, 9)));

  test("draw a character that the main camera does not see, in the detail of the nearest of them", () => {
    expect(seenBy(away, pose, 0.5, 1).inView).toBe(false);
    expect(drawnIn(away, pose, 0.5, 1).inView).toBe(false);
    const [near, far] = [2, 8].map((z) => furtherViews(renderer, [cameraAt(0, 0, z)]));
    const drawn = drawnIn([...away, ...far, ...near], pose, 0.5, 1);
    expect(drawn.inView).toBe(true);
    expect(drawn.headPx).toBeCloseTo(seenBy(near, pose, 0.5, 1).headPx, 6);
  });

  test("one that does not see the character adds no detail", () => {
    const far = furtherViews(renderer, [cameraAt(0, 0, 8)]);
    // This camera is the nearest one, but it turns its back on the character. If it counted, the head would be larger.
    const beside = furtherViews(renderer, [cameraAt(0, 0, 0.7, new Vector3(0, 0, 9))]);
    expect(drawnIn([...far, ...beside], pose, 0.5, 1).headPx).toBeCloseTo(seenBy(far, pose, 0.5, 1).headPx, 6);
  });

  test("a cube camera sees all around it, with the pixels of its target", () => {
    const target = new WebGLCubeRenderTarget(128);
    const [view] = furtherViews(renderer, [new CubeCamera(0.1, 100, target)]);
    // The heads are on three sides of the camera. A usual camera sees at most one of them.
    for (const at of [
      [0, 0, 2],
      [0, -2, 0],
      [2, 0, 0],
    ] as const) {
      const seen = seenBy([view], rigidPose([0, 0, 0, 1], [...at]), 0.1, 1);
      expect(seen.inView).toBe(true);
      // Each face sees 90 degrees in 128 pixels, so a metre at 1 m is 64 pixels. The head of 0.24 m (kHeadM) is 2 m
      // away.
      expect(seen.headPx).toBeCloseTo((0.24 * 64) / 2, 6);
    }
  });

  test("the parts of an array camera count one by one", () => {
    const parts = [cameraAt(0, 0, 3, new Vector3(0, 0, 9)), cameraAt(0, 0, 3)];
    for (const part of parts) (part as { viewport?: Vector4 }).viewport = new Vector4(0, 0, 300, 200);
    const views = viewsOf(renderer, new ArrayCamera(parts));
    expect(views.map((view) => seenBy([view], pose, 0.5, 1).inView)).toEqual([false, true]);
    expect(views[0].heightPx).toBe(200);
  });

  test("a mirror's plane cuts what is in front of it, and nothing is too far behind it", () => {
    const camera = cameraAt(0, 0, 3);
    // The mirror is about the plane z = 1 in front of the camera. As a real mirror does, it makes itself the near plane
    // of the projection (Lengyel, oblique near-plane clipping), which skews the far plane.
    const plane = new Vector4(0, 0.2, -0.98, -2);
    const { elements } = camera.projectionMatrix;
    const q = new Vector4(
      (Math.sign(plane.x) + elements[8]) / elements[0],
      (Math.sign(plane.y) + elements[9]) / elements[5],
      -1,
      (1 + elements[10]) / elements[14],
    );
    plane.multiplyScalar(2 / plane.dot(q));
    elements[2] = plane.x;
    elements[6] = plane.y;
    elements[10] = plane.z + 1;
    elements[14] = plane.w;
    const views = furtherViews(renderer, [camera]);
    const seenAt = (z: number) => seenBy(views, rigidPose([0, 0, 0, 1], [0, 0, z]), 0.1, 1).inView;
    // At z = 2 the head is between the camera and the mirror, and at z = 0 it is behind the mirror.
    expect(seenAt(2)).toBe(false);
    expect(seenAt(0)).toBe(true);
    // This head is 93 m away and within the camera's 100 m. The skewed far plane must not hide it.
    expect(seenAt(-90)).toBe(true);
  });
});

describe("shadow maps", async () => {
  const geometry = await geometryOf(await strandsFile());
  await startClient();
  const scene = new Scene();
  const sun = new DirectionalLight();
  sun.position.set(0, 5, 0);
  scene.add(sun, sun.target);

  test("of lights that cast shadows see characters, and others do not", () => {
    expect(shadowViews(scene)).toHaveLength(0);
    sun.castShadow = true;
    const views = shadowViews(scene);
    // The shadow map of a directional light reaches 5 m to each side by default in three.js.
    expect(seenBy(views, rigidPose([0, 0, 0, 1], [1, 0, 1]), 0.3, 1).inView).toBe(true);
    expect(seenBy(views, rigidPose([0, 0, 0, 1], [30, 0, 0]), 0.3, 1).inView).toBe(false);
    sun.visible = false;
    expect(shadowViews(scene)).toHaveLength(0);
    sun.visible = true;
  });

  test("do not raise the detail, and what only they see is drawn for its distance", () => {
    const pose = rigidPose([0, 0, 0, 1], [0, 0, 0]);
    const seeing = viewsOf(fakeRenderer(), cameraAt(0, 0, 5));
    expect(drawnIn([...seeing, ...shadowViews(scene)], pose, 0.3, 1).headPx).toBeCloseTo(
      seenBy(seeing, pose, 0.3, 1).headPx,
      6,
    );
    // Now the camera at the same place looks the other way, and the shadow map alone sees the character.
    const turned = viewsOf(fakeRenderer(), cameraAt(0, 0, 5, new Vector3(0, 0, 9)));
    const only = drawnIn([...turned, ...shadowViews(scene)], pose, 0.3, 1);
    expect(only.inView).toBe(true);
    expect(only.headPx).toBeCloseTo(seenBy(seeing, pose, 0.3, 1).headPx, 6);
  });

  /** Draws one character, 600 pixels high with two follow hairs beside each strand, and returns its mesh of strands. */
  const drawingWith = (castShadow: boolean) => {
    const group = new Group();
    const uniforms = new SceneUniforms(new Texture(), new Texture(), new Texture());
    const drawing = new GroomDrawing(geometry, group, uniforms, () => {}, castShadow);
    const detail = { ...detailFor(600, 1, drawing.strandCount), followHairCount: 2 };
    drawing.show([{ detail, list: 0 }], 0, { drawCalls: 0, strands: 0, vertices: 0 });
    const strands = group.children.find((mesh) => mesh.visible && mesh.name === "hairnet strand");
    return { uniforms, group, strands: strands as Mesh<InstancedBufferGeometry, RawShaderMaterial> };
  };

  test("get each strand once, without follow hairs, at the size of the map, and pictures stay as they were", () => {
    const { strands, uniforms } = drawingWith(true);
    expect(strands.castShadow).toBe(true);
    const before = strands.geometry.instanceCount;
    // Each strand is drawn with its two follow hairs.
    expect(before).toBe(3);
    // three.js calls `onBeforeShadow` and `onAfterShadow` with these arguments. The functions under test read only the
    // renderer.
    const args = [scene, sun, sun.shadow.camera, strands.geometry, strands.customDepthMaterial!, null] as const;
    const renderer = fakeRenderer(new Vector4(0, 0, 512, 512));
    strands.onBeforeShadow(renderer, ...(args as unknown as [never, never, never, never, never, never]));
    // The one instance is the one character.
    expect(strands.geometry.instanceCount).toBe(1);
    expect((strands.customDepthMaterial as RawShaderMaterial).uniforms.copies.value).toBe(1);
    expect(uniforms.all.viewport_px.value.toArray()).toEqual([512, 512]);
    // A shadow map has one sample a pixel, unlike the antialiased canvas.
    expect(uniforms.all.samples.value).toBe(1);
    strands.onAfterShadow(renderer, ...(args as unknown as [never, never, never, never, never, never]));
    expect(strands.geometry.instanceCount).toBe(before);
    expect(strands.material.uniforms.copies.value).toBe(3);
  });

  // A program that wants no shadows of hair must not pay for them: each shadow map draws every strand once more.
  test("stay empty unless they are asked for", () => {
    for (const mesh of drawingWith(false).group.children) expect(mesh.castShadow).toBe(false);
  });

  test("have a depth shader for each part", () => {
    for (const part of drawingWith(true).group.children as Mesh[]) {
      const { defines, vertexShader } = part.customDepthMaterial as RawShaderMaterial;
      expect(defines).toHaveProperty(part.name.replace("hairnet ", "").toUpperCase());
      expect(vertexShader).toContain("gl_Position");
    }
    expect(shader("shadow.frag")).toContain("discard");
  });
});

// A ribbon of hair is widened to a share of a pixel (strand.vert), so shaders must know the viewport of each picture.
// With that of another picture, hair in a small one would be too thin or too wide.
test("each picture has the width of hair for its own viewport", () => {
  const uniforms = new SceneUniforms(new Texture(), new Texture(), new Texture());
  uniforms.setTarget(fakeRenderer(new Vector4(0, 0, 1280, 720)));
  expect(uniforms.all.viewport_px.value.toArray()).toEqual([1280, 720]);
  // This viewport is a small second picture on the same canvas. Its own size counts, and not where it begins.
  uniforms.setTarget(fakeRenderer(new Vector4(900, 0, 320, 180)));
  expect(uniforms.all.viewport_px.value.toArray()).toEqual([320, 180]);
});

describe("an environment", () => {
  /**
   * Makes an environment with the radiance `all` from everywhere, and more from `towards`. The first spherical harmonic
   * is the constant 0.282095, so its coefficient is the radiance over that number.
   */
  const radiance = (all: number, more = 0, towards = new Vector3(0, 1, 0)) => {
    const sh = new SphericalHarmonics3();
    sh.coefficients[0].setScalar(all / 0.282095);
    sh.coefficients[1].setScalar(more * towards.y);
    sh.coefficients[2].setScalar(more * towards.z);
    sh.coefficients[3].setScalar(more * towards.x);
    return sh;
  };

  test("that is the same everywhere is ambient light alone, as bright as it is", () => {
    const rig = makeLightRig();
    // A radiance of 0.5 at an intensity of 2 makes ambient light of 1.
    addEnvironment(rig, radiance(0.5), 2);
    for (const light of [rig.ambientAbove, rig.ambientBelow]) expect(light.r).toBeCloseTo(1, 3);
    for (const light of rig.colours) expect(light.r).toBe(0);
  });

  test("that has a bright side lights hair from there, and its sum stays the same", () => {
    const rig = makeLightRig();
    const side = new Vector3(0.6, 0.8, 0);
    addEnvironment(rig, radiance(0.5, 0.4, side), 1);
    expect(rig.towards[0].distanceTo(side)).toBeLessThan(1e-6);
    // The directional light is what the side has more than the opposite side: 4 * 0.511664 * 0.4 / pi = 0.26, where
    // 0.511664 is three.js's factor for the harmonics that `more` sets.
    expect(rig.colours[0].r).toBeGreaterThan(0.1);
    // A surface that faces up gets the ambient light, and 0.8 of the directional light: 0.8 is the cosine of the angle
    // between them. Together they must be what three.js computes for the environment.
    const up = radiance(0.5, 0.4, side).getIrradianceAt(new Vector3(0, 1, 0), new Vector3()).x / Math.PI;
    expect(rig.ambientAbove.r + 0.8 * rig.colours[0].r).toBeCloseTo(up, 6);
  });

  test("adds to the scene's own lights and takes the place of none", () => {
    const scene = new Scene();
    const suns = [1, 2, 3].map((intensity) => new DirectionalLight(0xffffff, intensity));
    scene.add(...suns, new AmbientLight(0xffffff, Math.PI));
    const rig = makeLightRig();
    sceneLights(scene, rig);
    const before = rig.colours.map((colour) => colour.r);
    addEnvironment(rig, radiance(0.5, 0.4), 1);
    expect(rig.colours.map((colour) => colour.r)).toEqual(before);
    // The rig has three directional lights, and the suns have taken all of them. So the whole environment becomes
    // ambient light: at least 0.5, beside 1 from the scene's own ambient light.
    expect(rig.ambientAbove.r).toBeGreaterThan(1.4);
  });
});

test("fog of both kinds reaches the shaders, and goes when the scene has none", () => {
  const uniforms = new SceneUniforms(new Texture(), new Texture(), new Texture());
  const range = () => uniforms.all.fog_range.value.toArray();
  // `fog_range` has the near and far distance of a `Fog`, m, and the density of a `FogExp2`. The kind that the scene
  // does not have is 0.
  uniforms.setFog(new Fog(0xffffff, 2, 9));
  expect(range()).toEqual([2, 9, 0]);
  expect(uniforms.all.fog_colour.value.r).toBe(1);
  uniforms.setFog(new FogExp2(0xffffff, 0.3));
  expect(range()).toEqual([0, 0, 0.3]);
  uniforms.setFog(null);
  expect(range()).toEqual([0, 0, 0]);
});

test("the studio's lights turn with the camera, and hair from above has them, too", async () => {
  const rig = makeLightRig();
  const module = await startClient();
  const lit = (x: number, y: number, z: number) => {
    studioLights(module, cameraAt(x, y, z), rig);
    for (const towards of rig.towards) expect(towards.length()).toBeCloseTo(1, 5);
    return rig.towards[0].clone();
  };
  // The key light is 42 degrees to the camera's left and 42 degrees up (client/draw/light_rig.cpp), so its direction is
  // about (-0.5, 0.67, 0.55).
  const front = lit(0, 1, 3);
  expect(front.z).toBeGreaterThan(0.3);
  expect(front.x).toBeLessThan(-0.3);
  expect(rig.colours[0].r).toBeGreaterThan(1);
  expect(rig.ambientAbove.r).toBeGreaterThan(rig.ambientBelow.r);
  const side = lit(3, 1, 0);
  expect(side.toArray()).toEqual([front.z, front.y, -front.x].map((each) => expect.closeTo(each, 5)));
  // A camera straight above has no bearing; the light keeps its height.
  expect(lit(0, 3, 0).y).toBeCloseTo(front.y, 5);
});
