import { MathUtils, type PerspectiveCamera, Spherical, type Vector3 } from "three";
import type { OrbitControls } from "three/addons/controls/OrbitControls.js";

/** A camera's place about a point: the bearing is about +Y from +Z, the height is an angle above the horizon, rad. */
export interface CameraView {
  readonly target: Vector3;
  readonly bearing: number;
  readonly height: number;
  readonly distance: number;
}

/** Each flight takes this time, however far it goes. */
const kFlightS = 1.3;
/** A full turn of the slow orbit takes 70 s. */
const kOrbitRadPerS = 0.09;
/** The rate, 1/s, at which the distance to a moving target decays: slow, because heads nod and shake. */
const kFollow = 2.5;
/** An arrow key turns the camera by this angle. */
const kKeyTurnRad = 0.12;
/** Arrow keys leave the camera below the zenith, where the picture would turn over, and a little below the horizon. */
const kKeyHeightMaxRad = 1.4;
const kKeyHeightMinRad = -0.3;
/** The key + multiplies the distance to the target by this factor, and the key - divides by it. */
const kKeyZoom = 0.88;

/** Moves a camera without jumps: flights, a slow orbit, and a target that moves. The user's own moves interrupt it. */
export class CameraMotion {
  /** Flights arrive at once, and there is no slow orbit: for people who prefer reduced motion. */
  isReduced = false;
  /** The flight that goes on. `share`: how much of its time has passed, 0 to 1. */
  #flight: { from: CameraView; to: CameraView; share: number } | null = null;
  /**
   * The slow orbit. `bearing`: its middle; `swing`: how far it goes; `angle`: how far a full orbit would have gone,
   * rad.
   */
  #orbit: { bearing: number; swing: number; angle: number } | null = null;

  constructor(
    private readonly camera: PerspectiveCamera,
    private readonly controls: OrbitControls,
  ) {
    controls.addEventListener("start", () => this.stop());
  }

  get isFlying(): boolean {
    return this.#flight !== null;
  }

  get isOrbiting(): boolean {
    return this.#orbit !== null;
  }

  get view(): CameraView {
    const { target } = this.controls;
    const at = new Spherical().setFromVector3(this.camera.position.clone().sub(target));
    return { target: target.clone(), bearing: at.theta, height: Math.PI / 2 - at.phi, distance: at.radius };
  }

  /** Flies there; the shorter way around the target. */
  flyTo(view: CameraView): void {
    this.#orbit = null;
    const from = this.view;
    const turn = MathUtils.euclideanModulo(view.bearing - from.bearing + Math.PI, 2 * Math.PI) - Math.PI;
    const to = { ...view, target: view.target.clone(), bearing: from.bearing + turn };
    this.#flight = { from, to, share: 0 };
    if (this.isReduced) this.update(kFlightS);
  }

  /** Puts the camera there at once, and ends flights and orbits. */
  set(view: CameraView): void {
    this.stop();
    this.#put(view);
  }

  /** Orbits slowly, by at most `swing` to both sides; infinite: around and around. */
  orbitSlowly(swing: number): void {
    if (this.isReduced) return;
    this.#orbit = { bearing: (this.#flight?.to ?? this.view).bearing, swing, angle: 0 };
  }

  stop(): void {
    this.#flight = null;
    this.#orbit = null;
  }

  /** Follows a target that moves. */
  follow(target: Vector3, dtS: number): void {
    if (this.#flight) this.#flight.to.target.copy(target);
    else {
      const step = target
        .clone()
        .sub(this.controls.target)
        .multiplyScalar(1 - Math.exp(-kFollow * dtS));
      this.controls.target.add(step);
      this.camera.position.add(step);
    }
  }

  update(dtS: number): void {
    if (this.#flight) {
      const { from, to } = this.#flight;
      this.#flight.share = Math.min(this.#flight.share + dtS / kFlightS, 1);
      const share = MathUtils.smootherstep(this.#flight.share, 0, 1);
      this.#put({
        target: from.target.clone().lerp(to.target, share),
        bearing: MathUtils.lerp(from.bearing, to.bearing, share),
        height: MathUtils.lerp(from.height, to.height, share),
        // The distance changes by the same factor in equal times, so that a person grows evenly in the picture.
        distance: from.distance * (to.distance / from.distance) ** share,
      });
      if (this.#flight.share === 1) this.#flight = null;
    } else if (this.#orbit) {
      const orbit = this.#orbit;
      orbit.angle += kOrbitRadPerS * dtS;
      const turned = orbit.swing === Infinity ? orbit.angle : swung(orbit.angle, orbit.swing);
      this.#put({ ...this.view, bearing: orbit.bearing + turned });
    }
    this.controls.update();
  }

  /** A key of the view: + and - zoom, arrows turn. Returns true if the camera uses it. */
  onKey(key: string): boolean {
    const { view } = this;
    const moved = {
      "+": { distance: view.distance * kKeyZoom },
      "=": { distance: view.distance * kKeyZoom },
      "-": { distance: view.distance / kKeyZoom },
      ArrowLeft: { bearing: view.bearing - kKeyTurnRad },
      ArrowRight: { bearing: view.bearing + kKeyTurnRad },
      ArrowUp: { height: Math.min(view.height + kKeyTurnRad, kKeyHeightMaxRad) },
      ArrowDown: { height: Math.max(view.height - kKeyTurnRad, kKeyHeightMinRad) },
    }[key];
    if (!moved) return false;
    this.set({ ...view, ...moved });
    return true;
  }

  #put({ target, bearing, height, distance }: CameraView): void {
    const within = MathUtils.clamp(distance, this.controls.minDistance, this.controls.maxDistance);
    this.controls.target.copy(target);
    this.camera.position.setFromSphericalCoords(within, Math.PI / 2 - height, bearing).add(target);
    this.camera.lookAt(target);
  }
}

/**
 * The turn of an orbit that goes to and fro. It starts at the speed of a full orbit (its slope at 0 is 1) and stays
 * within `swing` on both sides.
 */
function swung(angle: number, swing: number): number {
  return swing > 0 ? swing * Math.sin(angle / swing) : 0;
}
