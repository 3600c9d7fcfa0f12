import { Vector3, type Camera } from "three";
import type { PageHost } from "./pageHost";
import { FirstPerson } from "./play/firstPerson";
import { Gyroscope } from "./head/gyroscope";
import { inviteLink, inviteNote } from "./play/invite";
import { Mirror } from "./play/mirror";
import { kPresets, type Preset } from "./play/presets";

/**
 * Where the camera goes to see both the mirror and the own head: behind the right shoulder, in the axes of the head, m.
 * +Z is out of the face, +X to the head's left.
 */
const kBehindShoulder = new Vector3(-0.42, 0.22, -0.75);

/** Things to play with: presets, ways to turn the head, first person, a mirror, an invitation. */
export class PlayPanel {
  /** The camera in the own head; null: the camera is outside of it. */
  #firstPerson: FirstPerson | null = null;
  /** The mirror before the own face; null: there is none. */
  #mirror: Mirror | null = null;
  readonly #firstPersonButton: HTMLButtonElement;
  readonly #mirrorButton: HTMLButtonElement;
  /** The choice of what turns the head. */
  readonly #control: HTMLSelectElement;

  constructor(
    section: HTMLElement,
    private readonly host: PageHost,
  ) {
    const heading = document.createElement("h2");
    heading.textContent = "Play";
    section.append(heading, row("Try", ...kPresets.map((preset) => this.#presetButton(preset))));
    this.#control = select("Turn your head by", ["dragging it", "moving this device"]);
    this.#control.addEventListener("change", () => void this.#chooseSource(this.#control.selectedIndex));
    section.append(labelled("Turn your head by", this.#control));
    this.#firstPersonButton = button("First person", "Look out of your own head.", () => this.#toggleFirstPerson());
    this.#mirrorButton = button("Mirror", "Puts a mirror before your face.", () => this.#toggleMirror());
    section.append(row("View", this.#firstPersonButton, this.#mirrorButton));
    section.append(host.query.local ? aloneNote() : this.#invitation());
    // Escape leaves first person only: the camera goes back to where it was. The page's own listener, which would then
    // show everyone, does not get the key.
    const leave = (event: KeyboardEvent) => {
      if (event.key !== "Escape" || !this.#firstPerson) return;
      event.stopImmediatePropagation();
      this.#toggleFirstPerson();
    };
    addEventListener("keydown", leave, { capture: true });
  }

  /** The camera moves with the own head. */
  get isFirstPerson(): boolean {
    return this.#firstPerson !== null;
  }

  /** Cameras beside the page's own that need hair in this picture. */
  get cameras(): Camera[] {
    return this.#mirror ? [this.#mirror.cameraFor(this.host.stage.camera)] : [];
  }

  /** Call it before each drawing. */
  beforeDraw(): void {
    const pose = this.host.own?.newestPose ?? null;
    // Without an own character there is no head to look out of, and none for the mirror.
    if (!pose && this.#firstPerson) this.#toggleFirstPerson();
    if (!pose && this.#mirror) this.#toggleMirror();
    if (pose) this.#firstPerson?.follow(pose);
  }

  #presetButton(preset: Preset): HTMLButtonElement {
    return button(preset.label, preset.about, () => {
      if (preset.material) this.host.setMaterial(preset.material);
      if (preset.wind) this.host.setWind(preset.wind);
    });
  }

  /** Turns the head by another source. `which`: the index of the chosen option, where 1 is the device's sensor. */
  async #chooseSource(which: number): Promise<void> {
    const { head } = this.host;
    head.source?.stop();
    head.source = null;
    try {
      const source = which === 1 ? await Gyroscope.start() : null;
      if (this.#control.selectedIndex === which) head.source = source;
      // The user has chosen another source while this one started.
      else source?.stop();
    } catch (error) {
      if (this.#control.selectedIndex === which) this.#control.selectedIndex = 0;
      this.host.showError((error as Error).message);
    }
  }

  #toggleFirstPerson(): void {
    const { stage, own } = this.host;
    if (this.#firstPerson) {
      this.#firstPerson.leave();
      this.#firstPerson = null;
    } else if (!own) return this.host.showError(kJoinFirst);
    else this.#firstPerson = new FirstPerson(stage.camera);
    stage.orbit.enabled = this.#firstPerson === null;
    this.#firstPersonButton.setAttribute("aria-pressed", String(this.#firstPerson !== null));
  }

  #toggleMirror(): void {
    const { stage, own, head } = this.host;
    if (this.#mirror) {
      this.#mirror.dispose();
      this.#mirror = null;
    } else if (!own) return this.host.showError(kJoinFirst);
    else {
      this.#mirror = new Mirror(head.position, head.heading);
      stage.scene.add(this.#mirror);
      if (!this.#firstPerson) this.#lookIntoMirror();
    }
    this.#mirrorButton.setAttribute("aria-pressed", String(this.#mirror !== null));
  }

  #lookIntoMirror(): void {
    const { stage, head } = this.host;
    stage.isMoved = true;
    // The camera looks at a point between mirror and head, nearer to the mirror.
    stage.orbit.target.copy(this.#mirror!.position).lerp(head.position, 0.35);
    stage.camera.position.copy(kBehindShoulder).applyAxisAngle(stage.camera.up, head.heading).add(head.position);
    stage.orbit.update();
  }

  #invitation(): HTMLElement {
    const { query } = this.host;
    const link = inviteLink(new URL(location.href), query);
    const shown = document.createElement("input");
    shown.readOnly = true;
    shown.value = link.href;
    shown.setAttribute("aria-label", "Link to this room");
    shown.addEventListener("focus", () => shown.select());
    const copy = button("Copy link", "Copies the link to this room.", () => {
      // Without access to the clipboard the user copies it.
      navigator.clipboard?.writeText(link.href).then(
        () => (copy.textContent = "copied"),
        () => shown.select(),
      ) ?? shown.select();
      setTimeout(() => (copy.textContent = "Copy link"), 2000);
    });
    const details = document.createElement("details");
    const summary = document.createElement("summary");
    summary.textContent = "Invite a friend";
    const note = noteOf(inviteNote(link, query));
    note.hidden = note.textContent === "";
    details.append(summary, shown, copy, note);
    return details;
  }
}

function aloneNote(): HTMLElement {
  return noteOf("There is no server: this browser alone simulates the hair, and nobody else sees you.");
}

function noteOf(text: string): HTMLElement {
  const note = document.createElement("p");
  note.className = "note";
  note.textContent = text;
  return note;
}

/** The error of the things that need an own head. */
const kJoinFirst = "Choose a hairstyle first: this needs a head of your own.";

function button(label: string, about: string, onClick: () => void): HTMLButtonElement {
  const made = document.createElement("button");
  made.type = "button";
  made.textContent = label;
  made.title = about;
  made.addEventListener("click", onClick);
  return made;
}

function select(label: string, choices: readonly string[]): HTMLSelectElement {
  const made = document.createElement("select");
  made.setAttribute("aria-label", label);
  made.append(...choices.map((choice) => new Option(choice)));
  return made;
}

function labelled(text: string, control: HTMLElement): HTMLLabelElement {
  const made = document.createElement("label");
  made.className = "row";
  const span = document.createElement("span");
  span.textContent = text;
  made.append(span, control);
  return made;
}

function row(text: string, ...controls: HTMLElement[]): HTMLDivElement {
  const made = document.createElement("div");
  made.className = "buttons";
  made.role = "group";
  made.setAttribute("aria-label", text);
  made.append(...controls);
  return made;
}
