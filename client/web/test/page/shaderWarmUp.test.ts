import { type Object3D, PerspectiveCamera, Scene, type WebGLRenderer } from "three";
import { expect, test } from "vitest";
import { ShaderWarmUp } from "../../page/shaderWarmUp";
import { idleRenderer } from "../support/idleRenderer";
import { until } from "../support/until";

// Software takes seconds to compile the shaders of hair. The page compiles them while the first hair is on its way, by
// drawing a tiny hairstyle. Hair that stayed in the scene would be drawn in every picture.
test("a hair and a body are drawn once, and leave the scene", async () => {
  const scene = new Scene();
  const drawn: string[][] = [];
  const render = (what: Object3D) => {
    if (what !== scene) return;
    drawn.push([]);
    scene.traverseVisible(({ name }) => drawn.at(-1)!.push(name));
  };
  const warmUp = new ShaderWarmUp(
    { ...idleRenderer, render } as unknown as WebGLRenderer,
    scene,
    new PerspectiveCamera(),
    {},
  );
  await until("it is drawn", () => {
    warmUp.draw();
    return drawn.length > 0;
  });
  warmUp.draw();
  expect(drawn).toHaveLength(1);
  expect(drawn[0]).toEqual(expect.arrayContaining(["hairnet strand", "hairnet body"]));
  expect(scene.children).toEqual([]);
  warmUp.dispose();
});
