import { afterEach, describe, expect, test, vi } from "vitest";
import {
  connect,
  HairnetError,
  kPoseNumbers,
  materials,
  poseError,
  rigidPose,
  type OwnCharacter,
  type Room,
  type Wind,
} from "../../src/index";
import { windOf } from "../../src/room/wind";
import { errorOf } from "../support/errorOf";
import { strandsFile } from "../support/grooms";
import { waitingRoom } from "../support/waitingRoom";

// What TypeScript would refuse, as JavaScript passes it.
const any = (value: unknown) => value as never;

describe("addresses and options of connect", () => {
  test("that are none are refused with a HairnetError", async () => {
    // After an empty text and what is no text come addresses with a space, another scheme, no host, and a port above
    // 65535.
    for (const bad of ["", undefined, null, 7420, {}, "a b", "ftp://a", "ws://", "localhost:99999", "http://["]) {
      const error = await connect(any(bad)).catch((thrown: unknown) => thrown);
      expect(error, String(bad)).toBeInstanceOf(HairnetError);
      expect((error as HairnetError).code).toBe("invalid");
    }
  });

  test("must exist and be of the right type", async () => {
    const refusalOf = (options: object) =>
      connect("localhost:1", any(options)).then(
        () => null,
        (error: HairnetError) => `${error.code}: ${error.message}`,
      );
    expect(await refusalOf({ rooom: "hall" })).toBe(
      "unknown_option: connect: there is no option 'rooom'; did you mean 'room'?",
    );
    expect(await refusalOf({ room: 5 })).toBe("invalid: connect: the option 'room' is a string, not 5");
    expect(await refusalOf({ reconnect: "no" })).toBe("invalid: connect: the option 'reconnect' is a boolean, not no");
    expect(await refusalOf({ room: "no/slash" })).toMatch(/^invalid: connect: room: a name has at most 64/);
  });

  test("for the error of hair are in its range", async () => {
    const refusalOf = (errorM: unknown) =>
      connect("localhost:1", { errorM: any(errorM) }).catch((error: HairnetError) => `${error.code}: ${error.message}`);
    expect(await refusalOf("small")).toBe("invalid: connect: the option 'errorM' is a number, not small");
    // The error is 0 to 1 m.
    for (const bad of [-0.001, NaN, 2])
      expect(await refusalOf(bad)).toMatch(/^invalid: connect: error_m is not in \[0, 1\]$/);
  });
});

describe("arguments of a room", () => {
  test("that are no groom are refused, and the message says what to give", async () => {
    const room = await waitingRoom();
    // A web server that lacks the file often answers with a page, and a program that does not look passes it on.
    const page = new TextEncoder().encode("<!DOCTYPE html><title>404</title>");
    for (const [bad, pattern] of [
      [undefined, /not undefined; give the bytes of a \.groom file/],
      [null, /not null; give/],
      ["/bob.groom", /not a text; give/],
      [new Promise(() => {}), /not a Promise; give/],
      [[1, 2], /not a Array; give/],
      [page, /a web page, not a \.groom file/],
      [page.buffer, /a web page, not a \.groom file/],
      [new Uint8Array(3), /./],
      [new ArrayBuffer(200), /./],
    ] as const)
      expect(errorOf(() => room.addCharacter(any(bad))).message).toMatch(pattern);
    expect(errorOf(() => room.addCharacter(new Uint8Array(1), any(2))).message).toMatch(/options are an object like/);
    expect(errorOf(() => room.addCharacter(new Uint8Array(1), any({ lvl: 2 }))).message).toMatch(/'level'\?/);
    expect(errorOf(() => room.addCharacterLike(any(5))).message).toMatch(/one of room\.members/);
    expect(errorOf(() => room.removeCharacter(any(undefined))).message).toMatch(/what addCharacter returned/);
    room.close();
  });
});

describe("winds", () => {
  const close = (numbers: readonly number[]) => numbers.map((x) => expect.closeTo(x, 4));

  test("in few words get the rest by default", () => {
    expect(windOf({ speed: 3 })).toMatchObject({
      meanMPerS: close([-3, 0, 0]),
      // The defaults of wind.ts: gusts of 0.4, turbulence of 0.15 times the speed, from +X.
      gustRatio: expect.closeTo(0.4),
      turbulenceRmsMPerS: expect.closeTo(0.45),
    });
    expect(windOf({})).toMatchObject({ meanMPerS: close([0, 0, 0]), turbulenceRmsMPerS: 0 });
  });

  test("come from where 'from' says: 0 from +Z, 90 from +X", () => {
    expect(windOf({ speed: 2, from: 0 })?.meanMPerS).toEqual(close([0, 0, -2]));
    expect(windOf({ speed: 2, from: 90 })?.meanMPerS).toEqual(close([-2, 0, 0]));
    expect(windOf({ speed: 2, from: 180 })?.meanMPerS).toEqual(close([0, 0, 2]));
    expect(windOf({ speed: 2, from: -45 })?.meanMPerS).toEqual(close([Math.SQRT2, 0, -Math.SQRT2]));
    expect(windOf({ speed: 2, gust: 0, turbulence: 1 })).toMatchObject({ gustRatio: 0, turbulenceRmsMPerS: 1 });
  });

  test("of a Wind's own properties keep the others of still air", () => {
    const full: Wind = {
      meanMPerS: [1, 2, 3],
      gustRatio: 0.5,
      gustPeriodS: 2,
      turbulenceRmsMPerS: 0.25,
      turbulenceScaleM: 1,
      seed: 7n,
      carried: true,
    };
    expect(windOf(full)).toEqual(full);
    expect(windOf({ meanMPerS: [1, 0, 0] })).toMatchObject({ gustRatio: 0, gustPeriodS: 4, seed: 1n });
  });

  test("that are none are refused", async () => {
    const room = await waitingRoom();
    // Each wind has one fault: a misspelt name, a text, a negative speed, names of both kinds, a mean that is not 3
    // numbers, a seed that is no bigint, or it is no object.
    for (const [bad, pattern] of [
      [{ sped: 3 }, /no option 'sped'; did you mean 'speed'/],
      [{ speed: "3" }, /speed is not a number/],
      [{ speed: -1 }, /negative; turn the wind by 'from'/],
      [{ speed: 1, meanMPerS: [1, 0, 0] }, /either 'speed' or 'meanMPerS'/],
      [{ meanMPerS: [1, 0] }, /not 3 numbers/],
      [{ meanMPerS: 5 }, /not 3 numbers/],
      [{ gustRatio: 0.2, seed: 1 }, /seed is no bigint/],
      [5, /options are an object/],
      [undefined, /options are an object/],
    ] as const)
      expect(errorOf(() => room.setWind(any(bad))).message).toMatch(pattern);
    room.close();
  });
});

describe("materials", () => {
  test("by name are what servers take, and differ from the normal one", () => {
    for (const [name, { stiffness, damping, density, etherDamping, airDrag, gelPerS2 }] of Object.entries(materials)) {
      // The limits are those of schema/PROTOCOL.md, Materials and wind.
      expect(stiffness).toBeGreaterThanOrEqual(0.01);
      for (const factor of [stiffness, damping, etherDamping, airDrag]) expect(factor).toBeLessThanOrEqual(100);
      expect(density).toBeGreaterThanOrEqual(0.1);
      expect(density).toBeLessThanOrEqual(10);
      expect(gelPerS2).toBeLessThanOrEqual(10000);
      if (name !== "normal") expect({ ...materials[name as "wet"] }).not.toEqual(materials.normal);
    }
    expect(Object.keys(materials)).toEqual(["normal", "stiff", "soft", "wet", "gel", "underwater"]);
  });
});

test("a pose that is too far away is told with the limit", () => {
  expect(poseError(rigidPose([0, 0, 0, 1], [0, 0, -10001]))).toBe(
    "pose is too far away: -10001 m along an axis, of at most 10000 m",
  );
});

describe("numbers that a moment's computation has corrupted", () => {
  let room: Room;
  const withCharacter = async (): Promise<OwnCharacter> => {
    room = await waitingRoom();
    return room.addCharacter(await strandsFile(20, 6));
  };
  afterEach(() => room.close());

  test("are dropped, counted and reported once a second, and what was before stays", async () => {
    const me = await withCharacter();
    const warn = vi
      .spyOn(console, "warn")
      .mockReset()
      .mockImplementation(() => {});
    const clock = vi.spyOn(performance, "now").mockReturnValue(50_000);
    const good = rigidPose([0, 0, 0, 1], [1, 2, 3]);
    me.push(good);
    const turned = (...rotation: number[]) => rigidPose(rotation, [1, 2, 3]);
    // Each call has one damaged number: not finite, a rotation whose length is not 1, or a place beyond 10 km
    // (kPositionMaxM). A page that threw here would stop drawing for good.
    const calls: (() => void)[] = [
      () => me.push(turned(0, 0, 0, NaN)),
      () => me.push(turned(0, 0, 0, 0)),
      () => me.push(turned(1, 1, 0, 0)),
      () => me.push(rigidPose([0, 0, 0, 1], [0, Infinity, 0])),
      () => me.push(rigidPose([0, 0, 0, 1], [0, 0, -10001])),
      () => me.push(any(new Array(kPoseNumbers))),
      () => room.setWind({ speed: NaN }),
      () => room.setWind({ speed: 1, from: Infinity }),
      () => room.setWind({ meanMPerS: [0, NaN, 0] }),
      () => me.setMaterial({ stiffness: NaN }),
      () => me.setAppearance({ roughness: NaN }),
      () => me.setAppearance({ hairRoot: NaN }),
      () => room.reportImportance([{ member: 1, screenHeight: NaN, inView: true }]),
    ];
    calls.forEach((call, n) => {
      call();
      expect(room.counters.inputsDropped, String(call)).toBe(n + 1);
    });
    // The clock stands still, so all 13 are within the second that has one report.
    expect(warn).toHaveBeenCalledTimes(1);
    expect(warn.mock.calls[0][0]).toBe("hairnet: push of character 1: pose is not finite; it was dropped (1 so far)");
    expect(me.newestPose).toEqual(good);
    clock.mockRestore();
    warn.mockRestore();
  });

  test("are no excuse for what is no pose at all", async () => {
    const me = await withCharacter();
    // These are errors of the program and not of a computation, so they are thrown and not counted.
    for (const bad of [undefined, null, 5, [1, 2], new Float64Array(7)])
      expect(errorOf(() => me.push(any(bad))).code).toBe("invalid");
  });
});
