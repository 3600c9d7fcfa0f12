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

/** How near to a hair a press on it is. */
const kMousePx = 6;
const kFingerPx = 14;
/** A hand of which nothing has come for half a second is gone, and pictures may be seldom. */
const kSentEveryMs = 100;
/** Heads whose scales differ by less are of one size. */
const kSameSize = 0.01;

/** What touching needs of the page. */
export interface TouchHost extends Pick<PageHost, "stage" | "query" | "own"> {
  /** null: there is none, or no server */
  readonly served: Room | null;
}

/** The user's hands in the room, by mouse, finger or headset, and those of others. */
export class Touching {
  readonly #holds = new Holds();
  readonly #pointer = new PointerTouch(this.#holds);
  readonly #headset = new HeadsetTouch(this.#holds);
  readonly #shown = new ShownHands();
  #hasHands = false;

  constructor(
    private readonly host: TouchHost,
    private readonly hint: HTMLElement,
  ) {
    if (this.#mayNever) return;
    this.#listen();
    setInterval(() => this.#pointer.isPressed && this.#push(this.#pointer.hands(performance.now())), kSentEveryMs);
  }

  /** A press is of hair: the camera and the own head stay. */
  get isPressed(): boolean {
    return this.#pointer.isPressed;
  }

  get hasPinned(): boolean {
    return this.#holds.hasPinned;
  }

  enter(room: Room): void {
    this.#pointer.forget();
    this.#headset.forget();
    this.#holds.forget();
    this.#hasHands = false;
    room.on("held", ({ member, hand, pointCount }) =>
      this.#pointer.onHeld(member, hand, pointCount, performance.now()),
    );
    // The server has let all hair go: a press begins anew.
    room.on("state", () => {
      this.#pointer.forget();
      this.#headset.forget();
    });
  }

  /** Lets all hair fall that this user has pinned, and all of the own head. */
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
    // The own ones only where they are the user's real hands.
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

  /** Null: there is no headset. */
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

  // A press elsewhere is left to those who listen later: the own head and the camera.
  #listen(): void {
    const { stage } = this.host;
    const { canvas, orbit } = stage;
    let pointer: number | null = null;
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

  /** Returns true if there is hair that the user may touch. */
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
