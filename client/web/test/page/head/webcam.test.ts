import { Quaternion } from "three";
import { expect, test } from "vitest";
import { rotationOf } from "../../../page/head/headPose";
import { mirrored } from "../../../page/head/webcam";

test("a mirror image turns and tilts to the other side, and nods alike", () => {
  expect(mirrored({ rx: 0.2, ry: 0, rz: 0 })).toMatchObject({ pitchRad: expect.closeTo(0.2) });
  expect(mirrored({ rx: 0, ry: 0.5, rz: 0 })).toMatchObject({ yawRad: expect.closeTo(-0.5) });
  expect(mirrored({ rx: 0, ry: 0, rz: 0.3 })).toMatchObject({ rollRad: expect.closeTo(-0.3) });
});

test("all three together are the reflection of the face's rotation", () => {
  const half = (rad: number) => [Math.sin(rad / 2), Math.cos(rad / 2)];
  const [sx, cx] = half(0.3);
  const [sy, cy] = half(-0.4);
  const [sz, cz] = half(0.2);
  const face = new Quaternion(0, 0, sz, cz)
    .multiply(new Quaternion(0, sy, 0, cy))
    .multiply(new Quaternion(sx, 0, 0, cx));
  // A reflection in x keeps turns about x, and inverts those about y and z.
  const reflected = new Quaternion(face.x, -face.y, -face.z, face.w);
  const [x, y, z, w] = rotationOf(mirrored({ rx: 0.3, ry: -0.4, rz: 0.2 }));
  expect(reflected.angleTo(new Quaternion(x, y, z, w))).toBeLessThan(1e-6);
});
