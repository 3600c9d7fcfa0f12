import { Quaternion, Vector3 } from "three";
import { expect, test } from "vitest";
import type { CameraView } from "../../page/cameraMotion";
import { Focus, type Shown } from "../../page/focus";
import type { Stage } from "../../page/stage";
import { rigidPose } from "../../src/hair/pose";

/**
 * Stands for the stage, and records how the camera would move. The free part of the view is a window of 1280 x 720
 * pixels without the panel of 312.
 */
class FakeStage {
  isMoved = false;
  free = { width: 968, height: 720 };
  readonly flights: (CameraView | "all")[] = [];
  orbits = 0;
  readonly motion = {
    flyTo: (view: CameraView) => this.flights.push(view),
    set: (view: CameraView) => this.flights.push(view),
    follow: () => {},
    orbitSlowly: () => ++this.orbits,
  };
  distanceFor = ({ height }: { height: number }) => 3 * height;
  frame = () => this.flights.push("all");
}

/** A person with a head at (x, 1.6 m, 0), who looks along +Z. */
const person = (number: number, x: number, isReady = true, own = false) =>
  ({
    member: { member: number, own, groom: null, pose: rigidPose([0, 0, 0, 1], [x, 1.6, 0]) },
    character: { isReady, position: new Vector3(x, 1.6, 0), quaternion: new Quaternion(), scale: new Vector3(1, 1, 1) },
  }) as unknown as Shown;

// `focus.update` takes the people with a pose, the number of those whose pose is on its way, and the time since the
// picture before, s.
function begin() {
  const stage = new FakeStage();
  const heard: (number | null)[] = [];
  const focus = new Focus(stage as unknown as Stage, (one) => heard.push(one));
  return { stage, focus, heard };
}

test("at first it shows the most central person, and waits a while for that person's hair", () => {
  const { stage, focus } = begin();
  const three = [person(1, -1, false), person(2, 0, false), person(3, 0.9, false)];
  focus.update([], 0, 0.1);
  expect(focus.person).toBeNull();
  focus.update(three, 0, 0.1);
  expect(focus.person).toBe(2);
  const oneReady = [person(1, -1), three[1], three[2]];
  // The choice waits 3 s for the hair of the central person while others have hair (kWaitS of centralPerson.ts).
  for (let s = 0; s < 2.5; s += 0.1) focus.update(oneReady, 0, 0.1);
  expect(focus.person).toBe(2);
  for (let s = 0; s < 1; s += 0.1) focus.update(oneReady, 0, 0.1);
  expect(focus.person).toBe(1);
  // The central person's hair arrives too late: the camera must not turn away again.
  focus.update([person(1, -1), person(2, 0), person(3, 0.9)], 0, 0.1);
  expect(focus.person).toBe(1);
  // The orbit has begun for the first choice and for the second one.
  expect(stage.orbits).toBe(2);
});

test("at first it waits a moment for those whose pose is on its way", () => {
  const { focus } = begin();
  const three = [person(1, -1.2, false), person(2, -0.6, false), person(3, 0, false)];
  focus.update(three, 2, 0.1);
  // Two more poses are on their way, so the middle is not known yet; the choice waits 0.5 s for them (kComingS).
  expect(focus.person).toBeNull();
  focus.update([...three, person(4, 0.6, false), person(5, 1.2, false)], 0, 0.1);
  expect(focus.person).toBe(3);
});

test("it does not wait for one who never has a pose", () => {
  const { focus } = begin();
  // The wait for poses ends after 0.5 s (kComingS).
  for (let s = 0; s < 0.7; s += 0.1) focus.update([person(1, 0, false)], 1, 0.1);
  expect(focus.person).toBe(1);
});

test("it shows a calm person first rather than one who dances in the middle", () => {
  const { focus } = begin();
  // The first head moves at up to 1.8 m/s; 1 m/s counts as much as 3 m from the middle (kMovingM of centralPerson.ts).
  const at = (s: number) => [person(1, 0.3 * Math.sin(6 * s), false), person(2, 0.7, false), person(3, -0.9, false)];
  for (let s = 0; s < 1.5; s += 0.05) focus.update(at(s), 0, 0.05);
  expect(focus.person).toBe(2);
});

// The groom of such a person cannot be shown (`Member.error`), so the first view would stay without hair.
test("whose hair cannot be had is not the first", () => {
  const { focus } = begin();
  const broken = person(1, 0, false);
  Object.assign(broken.member, { error: "its groom is damaged" });
  focus.update([broken, person(2, 0.8, false)], 0, 0.1);
  expect(focus.person).toBe(2);
});

test("after the user's own move nothing moves the camera until the user chooses", () => {
  const { stage, focus } = begin();
  const two = [person(1, 0), person(2, 0.6)];
  focus.update(two, 0, 0.1);
  stage.isMoved = true;
  stage.flights.length = 0;
  // The panel is folded, and somebody joins: reasons to frame again in the first view.
  stage.free = { width: 1280, height: 720 };
  focus.update([...two, person(3, -0.6)], 0, 0.1);
  expect(stage.flights).toEqual([]);
  focus.show(3);
  focus.update([...two, person(3, -0.6)], 0, 0.1);
  expect(focus.person).toBe(3);
  expect((stage.flights[0] as CameraView).target.x).toBeCloseTo(-0.6, 6);
});

test("it frames everyone on demand, and again when people come or the free part changes", () => {
  const { stage, focus, heard } = begin();
  const two = [person(1, 0), person(2, 0.6)];
  focus.update(two, 0, 0.1);
  focus.showAll();
  stage.flights.length = 0;
  for (let n = 0; n < 3; ++n) focus.update(two, 0, 0.1);
  expect(stage.flights).toEqual(["all"]);
  focus.update([...two, person(3, -0.6)], 0, 0.1);
  stage.free = { width: 1280, height: 720 };
  focus.update([...two, person(3, -0.6)], 0, 0.1);
  expect(stage.flights).toEqual(["all", "all", "all"]);
  expect(heard.at(-1)).toBeNull();
  focus.restart();
  focus.update(two, 0, 0.1);
  expect(focus.person).not.toBeNull();
});

test("when the shown person leaves, it shows everyone who is left", () => {
  const { stage, focus } = begin();
  focus.show(2);
  focus.update([person(1, 0), person(2, 0.6)], 0, 0.1);
  stage.flights.length = 0;
  focus.update([person(1, 0)], 0, 0.1);
  expect(focus.person).toBeNull();
  expect(stage.flights).toEqual(["all"]);
});

test("it frames a head anew when an avatar makes it larger", () => {
  const { stage, focus } = begin();
  const one = person(1, 0);
  focus.show(1);
  focus.update([one], 0, 0.1);
  // An avatar makes the head three times as large.
  one.character.scale.setScalar(3);
  focus.update([one], 0, 0.1);
  const [before, after] = stage.flights as CameraView[];
  expect(stage.flights.length).toBe(2);
  // A head of three times the size needs almost three times the distance, or the picture would cut it off.
  expect(after.distance).toBeGreaterThan(1.5 * before.distance);
});
