import { describe, expect, test } from "vitest";
import { followYaw, poseOf, rotationOf, yawOf } from "../../../page/head/headPose";
import { readQuery } from "../../../page/query";
import { Bone, kNumbersPerBone, poseError } from "../../../src/hair/pose";

describe("a pose from a head alone", () => {
  test("upright has all bones equal", () => {
    const pose = poseOf([0, 0, 0, 1], [1, 2, 3], 0);
    for (let bone = 0; bone < 5; ++bone)
      expect([...pose.subarray(bone * kNumbersPerBone, (bone + 1) * kNumbersPerBone)]).toEqual(
        [0, 0, 0, 1, 1, 2, 3].map((x) => expect.closeTo(x, 12)),
      );
  });

  test("is valid however the head lies, and the trunk stays upright", () => {
    // The angles go all around in yaw, and in pitch almost to straight up and down.
    for (let yawRad = -3; yawRad < 3; yawRad += 0.7)
      for (let pitchRad = -1.5; pitchRad < 1.5; pitchRad += 0.4) {
        const pose = poseOf(rotationOf({ yawRad, pitchRad, rollRad: 0.3 }), [0, 1.6, 0], 0.2);
        expect(poseError(pose)).toBeNull();
        const trunk = pose.subarray(Bone.upperTrunk * kNumbersPerBone);
        expect([trunk[0], trunk[2]]).toEqual([0, 0]);
      }
  });

  test("head, neck and trunk meet at the neck's joint", () => {
    const pose = poseOf(rotationOf({ yawRad: 0.8, pitchRad: 0.4, rollRad: 0 }), [0, 1.6, 0], 0);
    // The point is the joint of the neck at rest, head space (kNeck of headPose.ts). All three bones must move it to
    // the same place, or the body would come apart.
    const joint = [Bone.head, Bone.neck, Bone.upperTrunk].map((bone) => moved(pose, bone, [0, -0.1, -0.02]));
    for (const axis of [0, 1, 2]) {
      expect(joint[1][axis]).toBeCloseTo(joint[0][axis], 9);
      expect(joint[2][axis]).toBeCloseTo(joint[0][axis], 9);
    }
  });

  test("the trunk stays for small turns and follows large ones without a jump", () => {
    // The trunk follows a head that turns by more than 0.6 rad (kTrunkFollowsBeyondRad).
    expect(followYaw(0, 0.5)).toBe(0);
    let body = 0;
    let before = 0;
    for (let head = 0; head < 7; head += 0.01) {
      body = followYaw(body, head);
      // The head turns by 0.01 rad a step and the trunk by no more, even where the angle passes pi.
      expect(Math.abs(body - before)).toBeLessThan(0.011);
      before = body;
    }
    // The head ends at 7 rad, so a trunk that stays within 0.6 rad of it ends above 6.
    expect(body).toBeGreaterThan(6);
    expect(yawOf(rotationOf({ yawRad: 1.1, pitchRad: 0.3, rollRad: 0 }))).toBeCloseTo(1.1, 6);
  });
});

test("reads room, server, token and role from the page's address", () => {
  const here = (search: string) => readQuery(new URL(`https://host:7420/index.html${search}`));
  expect(here("")).toEqual({ room: "", server: "https://host:7420", token: "", observe: false, local: false });
  expect(here("?room=hall&server=ws://other:1&token=a.b.c&observe")).toEqual({
    room: "hall",
    server: "ws://other:1",
    token: "a.b.c",
    observe: true,
    local: false,
  });
  expect(here("?observe=0").observe).toBe(false);
  // A page that another web server hands out names its server in its head (`pageServer`).
  const elsewhere = (search: string) =>
    readQuery(new URL(`https://pages.example/hair/${search}`), "wss://hair.example");
  expect(elsewhere("").server).toBe("wss://hair.example");
  expect(elsewhere("?server=ws://other:1").server).toBe("ws://other:1");
  expect(here("?local&observe")).toMatchObject({ local: true, observe: false });
  // Such a page names "none" where it has no server and simulates the hair itself.
  const alone = (search: string) => readQuery(new URL(`https://pages.example/hair/${search}`), "none");
  expect(alone("")).toMatchObject({ local: true, server: "https://pages.example" });
  expect(alone("?server=ws://other:1")).toMatchObject({ local: false, server: "ws://other:1" });
});

/** Where the bone moves a point of head space at rest: the rotation of the quaternion, then its position. */
function moved(pose: Float64Array, bone: Bone, rest: readonly number[]): number[] {
  const [x, y, z, w, ...position] = pose.subarray(bone * kNumbersPerBone, (bone + 1) * kNumbersPerBone);
  const cross = (a: readonly number[], b: readonly number[]) => [
    a[1] * b[2] - a[2] * b[1],
    a[2] * b[0] - a[0] * b[2],
    a[0] * b[1] - a[1] * b[0],
  ];
  const q = [x, y, z];
  const inner = cross(q, rest).map((c, i) => c + w * rest[i]);
  return cross(q, inner).map((c, i) => rest[i] + 2 * c + position[i]);
}
