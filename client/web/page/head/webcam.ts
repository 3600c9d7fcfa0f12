import { Euler } from "three";
import networkAddress from "facefilter/neuralNets/NN_LIGHT_1.json?url";
import type { HeadAngles } from "./headPose";
import type { HeadSource } from "./headSource";

const kReadyMs = 15_000;
const kFoundAt = 0.6; // of the tracker's certainty

/**
 * The head turns as the user's does before the camera, like a mirror. The tracker (facefilter) and its network come from
 * this page's server; pictures never leave the browser.
 */
export class Webcam implements HeadSource {
  angles: HeadAngles | null = null;

  private constructor(private readonly video: HTMLVideoElement) {}

  /** Rejects with one line when there is no camera, or the user refuses. */
  static async start(): Promise<Webcam> {
    if (!navigator.mediaDevices)
      throw new Error("Browsers give the camera only to pages with HTTPS, or from this machine.");
    const video = document.createElement("video");
    video.muted = true;
    video.playsInline = true;
    try {
      video.srcObject = await navigator.mediaDevices.getUserMedia({ video: { width: 320, height: 240 } });
    } catch (fault) {
      const { name, message } = fault as DOMException;
      if (name === "NotFoundError") throw new Error("This device has no camera.");
      if (name === "NotAllowedError") throw new Error("The browser was told not to share the camera.");
      throw new Error(`The camera cannot be used: ${message}`);
    }
    const webcam = new Webcam(video);
    try {
      await video.play();
      await webcam.#track();
    } catch (fault) {
      webcam.stop();
      throw fault;
    }
    return webcam;
  }

  stop(): void {
    this.angles = null;
    for (const track of (this.video.srcObject as MediaStream).getTracks()) track.stop();
    void tracker?.then(({ JEELIZFACEFILTER }) => JEELIZFACEFILTER.toggle_pause(true, false));
  }

  async #track(): Promise<void> {
    const isFirst = tracker === null;
    tracker ??= loadTracker();
    const { JEELIZFACEFILTER: faces, network } = await tracker;
    if (!isFirst) {
      await new Promise<void>((done) => faces.update_videoElement(this.video, done));
      current = this;
      await faces.toggle_pause(false, false);
      return;
    }
    current = this;
    await new Promise<void>((done, fail) => {
      const timer = setTimeout(() => fail(new Error("The face tracker did not start.")), kReadyMs);
      faces.init({
        canvas: document.createElement("canvas"),
        NNC: network,
        videoSettings: { videoElement: this.video },
        followZRot: true,
        maxFacesDetected: 1,
        callbackReady: (fault) => {
          clearTimeout(timer);
          if (!fault) return done();
          tracker = null;
          fail(new Error(`The face tracker cannot run here: ${fault}`));
        },
        callbackTrack: (face) => current?.take(face),
      });
    });
  }

  /** A face of the tracker. */
  take(face: { detected: number; rx: number; ry: number; rz: number }): void {
    this.angles = face.detected > kFoundAt ? mirrored(face) : null;
  }
}

/** The tracker turns a face about its x, y, then z axis in the picture; the head on the screen turns like a mirror's. */
export function mirrored({ rx, ry, rz }: { rx: number; ry: number; rz: number }): HeadAngles {
  const turn = new Euler(rx, -ry, -rz, "ZYX").reorder("YXZ");
  return { yawRad: turn.y, pitchRad: turn.x, rollRad: turn.z };
}

// The tracker exists once on a page: its library has no second instance.
let tracker: ReturnType<typeof loadTracker> | null = null;
let current: Webcam | null = null;

async function loadTracker() {
  const [{ JEELIZFACEFILTER }, network] = await Promise.all([
    import("facefilter/dist/jeelizFaceFilter.moduleES6.js"),
    fetch(networkAddress).then((answer) => answer.text()),
  ]);
  return { JEELIZFACEFILTER, network };
}
