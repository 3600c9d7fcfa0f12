import type { Size } from "./framing";

/** The first pictures have at most about this many pixels: few enough for a machine where software plays the GPU. */
const kPixels = 640 * 360;
/** A machine that draws this number of frames in a row, each within kFastMs, can draw all pixels. */
const kFastPictures = 5;
/** The same limit as kSlowMs of adaptiveQuality.ts: 36 frames a second. */
const kFastMs = 28;
/** The hairstyles of other people wait at most this long for the first hair, ms. */
const kHoldMs = 6000;
/** Frames get all their pixels this long after the first hair, also while some people have no hair yet, ms. */
const kCoarseMs = 8000;

/** What was in a picture; `FirstPictures.add` explains each. */
interface PictureOf {
  readonly hasPeople: boolean;
  readonly hasHair: boolean;
  readonly isWaiting: boolean;
}

/**
 * Chooses how many pixels the first frames have. On a slow machine the first hair comes sooner with few pixels. All
 * pixels come as soon as frames are fast, or everyone has hair.
 */
export class FirstPictures {
  /** How many frames in a row were fast up to now. */
  #fast = 0;
  /** The time since somebody was in the room. */
  #heldMs = 0;
  /** The time since the first frame with hair. */
  #shownMs = 0;
  /** Frames have all their pixels from now on. */
  #isOver = false;

  /** No picture had hair yet. */
  get isBeforeHair(): boolean {
    return this.#shownMs === 0;
  }

  /**
   * The page asks only for the groom of the person in the first view. Other grooms that arrive before would only delay
   * that person's hair.
   */
  get holdsOthers(): boolean {
    return this.isBeforeHair && this.#heldMs < kHoldMs;
  }

  /**
   * Call it for each picture. `frameMs`: from the one before; `hasPeople`: there are people; `hasHair`: the
   * picture has hair; `isWaiting`: somebody's hair cannot be drawn yet.
   */
  add(frameMs: number, { hasPeople, hasHair, isWaiting }: PictureOf): void {
    if (hasPeople) this.#heldMs += Math.max(frameMs, 1);
    if (!hasHair) return;
    this.#shownMs += Math.max(frameMs, 1);
    this.#fast = frameMs <= kFastMs ? this.#fast + 1 : 0;
    if (!isWaiting || this.#fast >= kFastPictures || this.#shownMs >= kCoarseMs) this.#isOver = true;
  }

  /** The factor on the picture's width and height, at most 1. The argument is the whole picture in device pixels. */
  share({ width, height }: Size): number {
    return this.#isOver ? 1 : Math.min(Math.sqrt(kPixels / (width * height)), 1);
  }
}
