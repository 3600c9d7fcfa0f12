import { Quaternion } from "three";
import type { Hand, Room } from "../src/index";
import type { Shown } from "./focus";
import type { PageHost } from "./pageHost";
import { type TrackedHand, trackedHands } from "./touch/handsOfHeadset";
import { HeadsetTouch } from "./touch/headsetTouch";
import { Holds } from "./touch/holds";
import { pickHair } from "./touch/pick";
import { PointerTouch } from "./touch/pointerTouch";
import { ShownHands } from "./touch/shownHands";

/** A press means a hair within this many CSS pixels. A finger is less exact than a mouse. */
const kMousePx = 6;
const kFingerPx = 14;
/** Hands are gone half a second after their last message. A timer sends them also when pictures are rare. */
const kSentEveryMs = 100;
/** An own head whose scale differs from 1 by more is drawn at another size than in the room, by an avatar. */
const kSameSize = 0.01;

/** What touching needs of the page. */
export interface TouchHost extends Pick<PageHost, "stage" | "query" | "own"> {
  /** The room of a server; null: the page is in none, or has no server. */
  readonly served: Room | null;
}

/** The user's hands in the room, by mouse, finger or headset, and those of others. */
export class Touching {
  readonly #holds = new Holds();
  readonly #pointer = new PointerTouch(this.#holds);
  readonly #headset = new HeadsetTouch(this.#holds);
  readonly #shown = new ShownHands();
  /** The last message to the server had hands, so the next one must say that they are gone. */
  #hasHands = false;

  constructor(
    private readonly host: TouchHost,
    private readonly hint: HTMLElement,
  ) {
    if (this.#mayNever) return;
    this.#listen();
    setInterval(() => this.#pointer.isPressed && this.#push(this.#pointer.hands(performance.now())), kSentEveryMs);
  }

  /** A pointer is down that was pressed on hair. Its moves turn neither the camera nor the own head. */
  get isPressed(): boolean {
    return this.#pointer.isPressed;
  }

  get hasPinned(): boolean {
    return this.#holds.hasPinned;
  }

  /** The page has entered this room: what was held in another one is forgotten. */
  enter(room: Room): void {
    this.#pointer.forget();
    this.#headset.forget();
    this.#holds.forget();
    this.#hasHands = false;
    room.on("held", ({ member, hand, pointCount }) =>
      this.#pointer.onHeld(member, hand, pointCount, performance.now()),
    );
    // A server lets all hair go when the connection breaks, so the user must press again.
    room.on("state", () => {
      this.#pointer.forget();
      this.#headset.forget();
    });
  }

  /** Ends this user's pins in all hair, and everyone's pins in the user's own hair, which then falls. */
  unpin(): void {
    const { served, own } = this.host;
    if (served) this.#holds.unpin(served, own?.member ?? null);
  }

  /** Call it before each picture, with everyone who is in it. */
  update(drawn: readonly Shown[]): void {
    const { served: room, stage } = this.host;
    const tracked = this.#tracked();
    if (room && !this.#mayNever) {
      this.#push(tracked?.map(({ hand }) => hand) ?? this.#pointer.hands(performance.now()));
      this.#headset.update(tracked ?? [], room);
    }
    // The user sees the own hands only in a headset, where they are real hands. A mouse has its pointer.
    this.#shown.show([...(room?.hands.values() ?? [])].flat().concat((tracked ?? []).map(({ hand }) => hand)));
    if (this.#shown.children.length === 0) this.#shown.removeFromParent();
    else stage.scene.add(this.#shown);
    const scaled = drawn.find(({ member, character }) => member.own && Math.abs(character.scale.y - 1) > kSameSize);
    this.#holds.drawnElsewhere = scaled?.member ?? null;
    const isOffered =
      !this.#holds.hasTouched &&
      !this.#mayNever &&
      drawn.some(({ member }) => member !== scaled?.member && room?.mayTouch(member));
    this.hint.hidden = !isOffered;
  }

  /** Observers have no hands, and there are none without a server. */
  get #mayNever(): boolean {
    return this.host.query.observe || this.host.query.local;
  }

  /** The hands that the headset tracks in this frame; null: the user wears no headset. */
  #tracked(): TrackedHand[] | null {
    const { xr } = this.host.stage.renderer;
    if (!xr.isPresenting) return null;
    const [frame, space, session] = [xr.getFrame(), xr.getReferenceSpace(), xr.getSession()];
    if (!frame || !space || !session) return [];
    return trackedHands(session.inputSources, frame, space, this.host.stage.rig.matrixWorld);
  }

  #push(hands: readonly Hand[]): void {
    if (hands.length > 0 || this.#hasHands) this.host.served?.pushHands(hands);
    this.#hasHands = hands.length > 0;
  }

  // A press that meets no hair is left to the listeners of the own head and of the camera, which come later.
  #listen(): void {
    const { stage } = this.host;
    const { canvas, orbit } = stage;
    let pointer: number | null = null;
    // Whether the orbit was enabled before the press, which disables it.
    let orbited = true;
    const down = (event: PointerEvent) => {
      if (this.isPressed && event.pointerType === "touch") this.#pointer.pinLater();
      if (this.isPressed || event.button !== 0 || !event.isPrimary || !this.#press(event)) return;
      pointer = event.pointerId;
      canvas.setPointerCapture(pointer);
      orbited = orbit.enabled;
      orbit.enabled = false;
    };
    const end = (event: PointerEvent) => {
      if (event.pointerId !== pointer) return;
      pointer = null;
      orbit.enabled = orbited;
      this.#pointer.release(event.altKey, performance.now());
    };
    canvas.addEventListener("pointerdown", down, { capture: true });
    canvas.addEventListener("pointermove", (event) => {
      if (event.pointerId === pointer) this.#pointer.move(stage.rayAt(event));
    });
    canvas.addEventListener("pointerup", end);
    canvas.addEventListener("pointercancel", end);
  }

  /** Takes the hair at a press. Returns false if there is no hair that the user may touch. */
  #press(event: PointerEvent): boolean {
    const { served: room, stage } = this.host;
    if (room?.state !== "connected") return false;
    const withinRad = (event.pointerType === "touch" ? kFingerPx : kMousePx) * stage.radPerPx;
    const picked = pickHair(stage.rayAt(event), withinRad, room.members.values());
    if (!picked || !room.mayTouch(picked.member) || picked.member === this.#holds.drawnElsewhere) return false;
    const rotation = stage.camera.getWorldQuaternion(new Quaternion());
    this.#pointer.press(picked, rotation, event.shiftKey, room, performance.now());
    this.#hasHands = true;
    return true;
  }
}
