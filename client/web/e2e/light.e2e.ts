// Tests of the light of hair that need pixels, beside light.test.ts, which needs no GPU.
import { mkdtempSync, rmSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { afterAll, beforeAll, expect, test } from "vitest";
import { strandsFile } from "../test/support/grooms";
import { Browser } from "./browser";
import type { LightStage, Shot } from "./lightPage";
import { StageServer } from "./stageServer";

/** A picture with more light must be at least so many times as bright. */
const kBrighter = 1.005;
const browser = new Browser(true);
const folder = mkdtempSync(join(tmpdir(), "hairnet-light-"));
/** The address at which vite serves the groom's file. */
const hair = `/@fs${folder}/strands.groom`;
let server: StageServer | undefined;

interface Globals {
  LightStage: typeof LightStage;
}

beforeAll(async () => {
  await browser.start();
  writeFileSync(`${folder}/strands.groom`, await strandsFile(2000, 24));
  server = await StageServer.open(browser, "lightPage", [folder]);
});
afterAll(async () => {
  await browser.dispose();
  await server?.dispose();
  rmSync(folder, { recursive: true });
});

/** The mean of red, green and blue over a square, `at` and `half` as shares of the picture's size. */
function meanOf({ pixels, size }: Shot, [x, y]: readonly [number, number], half: number): number[] {
  const sum = [0, 0, 0];
  let count = 0;
  for (let row = Math.floor((y - half) * size); row < (y + half) * size; ++row)
    for (let column = Math.floor((x - half) * size); column < (x + half) * size; ++column, ++count)
      for (let n = 0; n < 3; ++n) sum[n] += pixels[4 * (row * size + column) + n];
  return sum.map((each) => each / count);
}

const brightness = (colour: number[]) => colour[0] + colour[1] + colour[2];

test("the ground is darker under a head of hair that casts shadows, and elsewhere as bright as before", async () => {
  const [with_, without, under] = await server!.page.evaluate(async (address) => {
    const { LightStage: Stage } = window as unknown as Globals;
    const shots: Shot[] = [];
    let place: [number, number] = [0, 0];
    for (const shadows of [true, false]) {
      const stage = await Stage.open(address, { shadows, lights: "scene" });
      await stage.ready();
      stage.hair.update(stage.camera);
      shots.push(stage.shoot());
      // `place` is where the sun's rays through the middle of the hair meet the ground: its shadow falls there.
      const middle = stage.sun.position.clone().set(0, 1.25, 0);
      middle.addScaledVector(stage.sun.position, -middle.y / stage.sun.position.y).project(stage.camera);
      place = [(middle.x + 1) / 2, (1 - middle.y) / 2];
      stage.dispose();
    }
    return [shots[0], shots[1], place] as const;
  }, hair);
  const shadowed = brightness(meanOf(with_, under, 0.015));
  const lit = brightness(meanOf(without, under, 0.015));
  console.log(`under the head ${shadowed.toFixed(0)}, without shadows ${lit.toFixed(0)}`);
  // Ambient light remains in the shadow, and hair lets some light through.
  expect(shadowed).toBeLessThan(0.7 * lit);
  // The corner at the lower right is ground without any shadow.
  const away: [number, number] = [0.9, 0.9];
  expect(brightness(meanOf(with_, away, 0.03))).toBeCloseTo(brightness(meanOf(without, away, 0.03)), 0);
});

test("a mirrored room, in mirrored light, is the mirrored picture", async () => {
  const shots = await server!.page.evaluate(async (address) => {
    const { LightStage: Stage } = window as unknown as Globals;
    const taken: Shot[] = [];
    for (const mirror of [1, -1]) {
      const stage = await Stage.open(address, { lights: "scene", shadows: true }, [0.2, 1.2, 0]);
      // Hair below the head joint is drawn towards +x, so that the picture is not its own mirror image.
      stage.head.move((_x, y) => [y < 0 ? -0.4 * y : 0, 0, 0]);
      stage.hair.scale.x = mirror;
      stage.sun.position.x = 3 * mirror;
      stage.camera.position.set(0, 1.3, 1.4);
      stage.camera.lookAt(0, 1.2, 0);
      await stage.ready();
      stage.hair.update(stage.camera);
      taken.push(stage.shoot());
      stage.dispose();
    }
    return taken;
  }, hair);
  const [plain, mirrored] = shots;
  // Means of squares: hair is drawn with other random numbers at other places.
  const half = 0.02;
  const distance = (isFlipped: boolean) => {
    let sum = 0;
    for (let y = half; y + half < 1; y += 2 * half)
      for (let x = half; x + half < 1; x += 2 * half) {
        const other = meanOf(mirrored, [isFlipped ? 1 - x : x, y], half);
        sum += meanOf(plain, [x, y], half).reduce((all, each, n) => all + Math.abs(each - other[n]), 0);
      }
    return sum;
  };
  const [flipped, asItIs] = [distance(true), distance(false)];
  console.log({ flipped, asItIs });
  expect(asItIs).toBeGreaterThan(0);
  // What is left is the grain of the hair, which differs from picture to picture.
  expect(flipped).toBeLessThan(0.1 * asItIs);
});

test("a mirror, a second camera and a cube camera show hair that the main camera does not see", async () => {
  const shares = await server!.page.evaluate(async (address) => {
    const { LightStage: Stage } = window as unknown as Globals;
    const stage = await Stage.open(address, { lights: "scene" }, [0, 0, 2]);
    stage.ground.visible = false;
    const { camera } = stage;
    const mirror = stage.addMirror();
    mirror.position.set(0, 0, -1);
    await stage.ready();
    for (const one of stage.hair.characters.values()) one.hairColour.setRGB(0.4, 0.02, 0.02);
    // The head at z = 2 is behind the camera, which looks at the mirror at z = -1.
    camera.position.set(0, 0, 0.7);
    camera.lookAt(0, 0, -1);
    // Counts reddish pixels, as a share: only the hair is red.
    const red = ({ pixels }: Shot) => {
      let count = 0;
      for (let p = 0; p < pixels.length; p += 4) if (pixels[p] > pixels[p + 1] + 25) ++count;
      return count / (pixels.length / 4);
    };
    const reflected = mirror.getReflectionCamera(camera);
    const shoot = (more: boolean) => {
      for (let n = 0; n < 2; ++n) {
        if (more) stage.hair.update(camera, reflected);
        else stage.hair.update(camera);
        stage.shoot();
      }
      return red(stage.shoot());
    };
    const without = shoot(false);
    const inMirror = shoot(true);
    const second = camera.clone();
    second.position.set(0, 0.1, 4);
    second.lookAt(0, 0.05, 2);
    stage.hair.update(camera, second);
    // This is a picture in the picture, half as wide and high.
    stage.renderer.setViewport(0, 0, 200, 200);
    const pictureInPicture = red(stage.shoot(second));
    stage.dispose();
    return { without, inMirror, pictureInPicture };
  }, hair);
  console.log(shares);
  expect(shares.without).toBe(0);
  // The head is small in the mirror and in the second picture, so few pixels are red: 0.2 % are 320 of 160 000.
  expect(shares.inMirror).toBeGreaterThan(0.002);
  expect(shares.pictureInPicture).toBeGreaterThan(0.002);
});

test("an environment alone lights hair, and brighter ones more", async () => {
  const [dark, dim, bright] = await server!.page.evaluate(
    async ([address, brighter]) => {
      const { LightStage: Stage } = window as unknown as Globals;
      const stage = await Stage.open(address, { lights: "scene" });
      stage.scene.remove(stage.sun);
      stage.scene.traverse((object) => {
        if ((object as { isAmbientLight?: boolean }).isAmbientLight) object.visible = false;
      });
      stage.ground.visible = false;
      stage.camera.position.set(0, 1.3, 1.2);
      stage.camera.lookAt(0, 1.25, 0);
      // The browser draws in software, so fewer strands are drawn.
      stage.hair.quality = 0.3;
      await stage.ready();
      const sum = () => {
        stage.hair.update(stage.camera);
        const { pixels } = stage.shoot();
        let light = 0;
        for (let p = 0; p < pixels.length; p += 4) light += pixels[p] + pixels[p + 1];
        return light;
      };
      /**
       * The sum once it is above `least` and then stays the same: the light of an environment is found in the
       * background while pictures go on.
       */
      const settled = async (least: number) => {
        let [last, now] = [Number.NaN, sum()];
        for (const start = performance.now(); now <= least || now !== last; now = sum()) {
          if (performance.now() - start > 60_000) break;
          last = now;
          await new Promise((done) => setTimeout(done, 100));
        }
        return now;
      };
      const sums = [await settled(0)];
      stage.useRoom();
      for (const intensity of [0.3, 1]) {
        stage.scene.environmentIntensity = intensity;
        sums.push(await settled(brighter * sums[sums.length - 1]));
      }
      stage.dispose();
      return sums;
    },
    [hair, kBrighter] as const,
  );
  console.log({ dark, dim, bright });
  expect(dim).toBeGreaterThan(kBrighter * dark);
  expect(bright).toBeGreaterThan(kBrighter * dim);
});

test("light follows hair that is drawn aside, at rest it is the traced light, and no error is reported", async () => {
  const [still, moved] = await server!.page.evaluate(async (address) => {
    const { LightStage: Stage } = window as unknown as Globals;
    const stage = await Stage.open(address, {});
    stage.ground.visible = false;
    stage.camera.position.set(0, 1.3, 1.1);
    stage.camera.lookAt(0, 1.25, 0);
    await stage.ready();
    const { extensions } = stage.renderer;
    const has = extensions.has.bind(extensions);
    // Draws with light that follows moved hair, and with light that was traced at rest, and returns the mean difference
    // of a value (0 to 255). Without float targets the scene uses the traced light.
    const difference = () => {
      const shots = [true, false].map((follows) => {
        extensions.has = (name: string) => (follows || name !== "EXT_color_buffer_float") && has(name);
        stage.hair.update(stage.camera);
        return stage.shoot().pixels;
      });
      return shots[0].reduce((sum, value, n) => sum + Math.abs(value - shots[1][n]), 0) / shots[0].length;
    };
    const atRest = difference();
    stage.head.move((x, y) => [0.5 * Math.sign(x) * Math.min(Math.max(0.15 - y, 0), 0.1), 0, 0]);
    // The hair is parted: both halves are drawn up to 5 cm outwards, so light reaches what was in the shade.
    const apart = difference();
    stage.dispose();
    return [atRest, apart];
  }, hair);
  console.log({ still, moved });
  // The values are means over all pixels, most of which show no hair. At rest both pictures must be the same but for
  // rounding.
  expect(still).toBeLessThan(0.05);
  expect(moved).toBeGreaterThan(0.2);
  expect(browser.takeErrors().filter((error) => !error.includes("404"))).toEqual([]);
});
