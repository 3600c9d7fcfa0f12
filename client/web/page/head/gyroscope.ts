import { Euler, MathUtils, Quaternion } from "three";
import type { HeadAngles } from "./headPose";
import type { HeadSource } from "./headSource";

/** A device that tells nothing for this long has no sensor, or does not let the page read it. */
const kWaitMs = 2000;

type Orientation = Pick<DeviceOrientationEvent, "alpha" | "beta" | "gamma">;

/** Safari asks the user before it tells how the device is held. */
type AskingOrientationEvent = typeof DeviceOrientationEvent & { requestPermission?: () => Promise<string> };

/**
 * The head turns as a hand-held device does: the person on the screen looks out of it, and so has the device's axes at
 * the start.
 */
export class Gyroscope implements HeadSource {
  /** The angles since the start; see `HeadSource`. */
  angles: HeadAngles | null = null;
  /** The rotation of the device when its head looked ahead; null: the next event sets it. */
  #start: Quaternion | null = null;

  /** Call it in a click: browsers may ask the user. Rejects with one line when the device tells nothing. */
  static async start(): Promise<Gyroscope> {
    if (typeof DeviceOrientationEvent === "undefined")
      throw new Error(isSecureContext ? kNoSensor : "Browsers give motion sensors only to pages with HTTPS.");
    const ask = (DeviceOrientationEvent as AskingOrientationEvent).requestPermission;
    if (ask && (await ask.call(DeviceOrientationEvent)) !== "granted")
      throw new Error("The browser was told not to share the motion sensor. Allow it in the page's settings.");
    const gyroscope = new Gyroscope();
    addEventListener("deviceorientation", gyroscope.#take);
    screen.orientation?.addEventListener("change", gyroscope.#restart);
    const end = performance.now() + kWaitMs;
    while (!gyroscope.angles && performance.now() < end) await new Promise((done) => setTimeout(done, 50));
    if (gyroscope.angles) return gyroscope;
    gyroscope.stop();
    throw new Error(kNoSensor);
  }

  stop(): void {
    removeEventListener("deviceorientation", this.#take);
    screen.orientation?.removeEventListener("change", this.#restart);
  }

  // After the picture has turned on the device, its axes are others: the head looks ahead again from there.
  readonly #restart = () => (this.#start = null);

  readonly #take = (event: DeviceOrientationEvent) => {
    const now = rotationOfDevice(event, screen.orientation?.angle ?? 0);
    if (!now) return;
    this.#start ??= now;
    this.angles = headAngles(this.#start, now);
  };
}

const kNoSensor = "This device has no motion sensor that the page can read.";

/**
 * The rotation from the axes of the picture on the screen (x right, y up, z towards the user) to the world's; null: the
 * device does not know. `screenDeg`: by how much the picture is turned on the device.
 */
export function rotationOfDevice(event: Orientation, screenDeg: number): Quaternion | null {
  const { alpha, beta, gamma } = event;
  if (alpha === null || beta === null || gamma === null) return null;
  const [z, x, y] = [alpha, beta, gamma].map(MathUtils.degToRad);
  const device = new Quaternion().setFromEuler(new Euler(x, y, z, "ZXY"));
  return device.multiply(new Quaternion().setFromEuler(new Euler(0, 0, MathUtils.degToRad(-screenDeg))));
}

/** How a head turns with the picture on the screen, from `start` to `now`. */
export function headAngles(start: Quaternion, now: Quaternion): HeadAngles {
  const turn = new Euler().setFromQuaternion(start.clone().invert().multiply(now), "YXZ");
  return { yawRad: turn.y, pitchRad: turn.x, rollRad: turn.z };
}
