import type { Groom } from "../src/index";

/** In CSS pixels. */
export interface Size {
  readonly width: number;
  readonly height: number;
}

/** The pixels that controls cover at the right and at the bottom of the view. */
export interface Covered {
  readonly right: number;
  readonly bottom: number;
}

/** The part of a person that a portrait shows, relative to the head joint, m. */
export interface Portrait {
  readonly bottom: number;
  readonly top: number;
  /** Half the width in the widest direction. */
  readonly halfWidth: number;
}

/** A point on the ground, m. */
export interface Place {
  readonly x: number;
  readonly z: number;
}

/** A head without hair. */
export const kBareHead: Portrait = { bottom: -0.16, top: 0.16, halfWidth: 0.12 };
/** A portrait reaches no lower than this: it cuts longer hair instead of showing a small face. */
const kBottomMinM = -0.34;
/** The share of the free height, and of the free width, that a portrait fills. */
const kFillHeight = 0.8;
const kFillWidth = 0.84;
/** A portrait is at least this high, m: short hair would otherwise bring the camera too close. */
const kHeightMinM = 0.44;
/** A person who stands nearer than this to the line from the camera to another person hides that person, m. */
const kShoulderM = 0.32;

/** The part of the view that controls leave free. */
export function freePart(view: Size, covered: Covered): Size {
  return { width: Math.max(view.width - covered.right, 1), height: Math.max(view.height - covered.bottom, 1) };
}

/** The portraits that have been measured. A groom never changes. */
const portraits = new WeakMap<Pick<Groom, "points">, Portrait>();

/**
 * The portrait of anyone who wears this hairstyle; null: of a bare head. `size`: of the head, as a share of the
 * hairstyle's own.
 */
export function portraitOf(groom: Pick<Groom, "points"> | null, size = 1): Portrait {
  const portrait = groom ? (portraits.get(groom) ?? measure(groom)) : kBareHead;
  if (groom) portraits.set(groom, portrait);
  if (size === 1) return portrait;
  return { bottom: size * portrait.bottom, top: size * portrait.top, halfWidth: size * portrait.halfWidth };
}

function measure({ points }: Pick<Groom, "points">): Portrait {
  let { bottom, top, halfWidth } = kBareHead;
  for (let i = 0; i + 2 < points.length; i += 3) {
    bottom = Math.min(bottom, points[i + 1]);
    top = Math.max(top, points[i + 1]);
    halfWidth = Math.max(halfWidth, Math.abs(points[i]), Math.abs(points[i + 2]));
  }
  return { bottom: Math.max(bottom, kBottomMinM), top, halfWidth };
}

/**
 * The distance at which a box of this width and height (m) fits into the free part of the view. `fovDeg`: of the whole
 * view's height.
 */
export function distanceFor(box: Size, fovDeg: number, view: Size, free: Size): number {
  const metresPerPixel = (2 * Math.tan((fovDeg * Math.PI) / 360)) / view.height;
  return Math.max(box.width / (free.width * metresPerPixel), box.height / (free.height * metresPerPixel));
}

/** The box of a portrait with the room that it needs about itself, m. */
export function boxOf({ bottom, top, halfWidth }: Portrait): Size {
  return {
    width: (2 * halfWidth) / kFillWidth,
    height: Math.max((top - bottom) / kFillHeight, kHeightMinM),
  };
}

/**
 * The bearing from which a camera sees a person at `at` unhidden by others: a three-quarter view of the face if
 * possible, with others behind. `heading` is the person's; bearings are about +Y from +Z, in rad.
 */
export function clearBearing(at: Place, heading: number, others: readonly Place[], distance: number): number {
  // The score is in metres of clearance. Others nearer to the camera than the person cost up to 0.2, and each rad away
  // from the three-quarter view (0.6 rad) costs 0.1. Clearance above kShoulderM counts no more.
  let best = heading;
  let bestScore = -Infinity;
  for (const turn of [0.6, -0.6, 0.3, -0.3, 0.9, -0.9, 1.3, -1.3]) {
    const bearing = heading + turn;
    const clearance = Math.min(...others.map((other) => clearanceOf(at, bearing, other, distance)), kShoulderM);
    const ahead = others.reduce((sum, other) => sum + aheadOf(at, bearing, other), 0) / Math.max(others.length, 1);
    const score = clearance - 0.2 * Math.min(Math.max(ahead, -1), 1) - 0.1 * Math.abs(Math.abs(turn) - 0.6);
    if (score <= bestScore) continue;
    best = bearing;
    bestScore = score;
  }
  return best;
}

/** The angle by which a camera may turn to both sides of `bearing` before another person hides this one, rad. */
export function clearSwing(
  at: Place,
  bearing: number,
  others: readonly Place[],
  distance: number,
  swingMax: number,
): number {
  // 0.05 rad are 3 degrees.
  const kStep = 0.05;
  for (let swing = kStep; swing <= swingMax; swing += kStep)
    for (const side of [-swing, swing])
      if (others.some((other) => clearanceOf(at, bearing + side, other, distance) < kShoulderM)) return swing - kStep;
  return swingMax;
}

/** How far `other` is beside the line from `at` to the camera; infinite when it is behind. */
function clearanceOf(at: Place, bearing: number, other: Place, distance: number): number {
  const ahead = aheadOf(at, bearing, other);
  if (ahead < 0.05 || ahead > distance + kShoulderM) return Infinity;
  return Math.abs((other.x - at.x) * Math.cos(bearing) - (other.z - at.z) * Math.sin(bearing));
}

/** How much nearer to the camera `other` is than `at`. */
function aheadOf(at: Place, bearing: number, other: Place): number {
  return (other.x - at.x) * Math.sin(bearing) + (other.z - at.z) * Math.cos(bearing);
}
