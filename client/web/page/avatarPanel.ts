import type { Mesh, Scene } from "three";
import type { Groom, Pose } from "../src/index";
import type { HairCharacter } from "../src/scene/index";
import type * as avatars from "./avatar/avatar";
import { isolated } from "./isolated";
import { kFitAsFound, RememberedFits, type RememberedFit } from "./avatar/rememberedFits";
import { messageOf } from "./errorWords";

/** What the panel needs of the page. */
export interface AvatarHost {
  readonly stage: { readonly scene: Scene };
  showError(detail: string): void;
  /** The user has put on a model. A user without a character gets one, with hair. */
  join(): void;
}

/** The slider of the hair's size goes from 1 - kSizeChange to 1 + kSizeChange times the measured size. */
const kSizeChange = 0.4;
/** The sliders of height and depth move hair by up to this, m on a head of a person's size; see `#unit`. */
const kShiftM = 0.08;
/** The list of the model's parts has at most this many lines. */
const kMeshesShownMax = 60;

/**
 * The section "Avatar": the user wears a VRM model as the own body. Models stay in this browser; other people see the
 * hair on the groom's own bust.
 */
export class AvatarPanel {
  avatar: avatars.Avatar | null = null;
  readonly #fits = new RememberedFits();
  readonly #name = make("p", { className: "note" });
  readonly #file = make("input", { type: "file", accept: ".vrm" });
  readonly #controls = make("div", { hidden: true });
  /** The check boxes that hide parts of the model. */
  readonly #parts = make("ul");
  readonly #sliders: readonly Slider[];
  readonly #takeOff = make("button", { type: "button", textContent: "Take off", hidden: true });
  /** The model's file, by its hash (`RememberedFits.keyOf`). */
  #key = "";
  #fit: RememberedFit = { ...kFitAsFound };
  /** The number of the newest request for a model. A model that arrives for an older one is thrown away. */
  #request = 0;

  constructor(
    section: HTMLElement,
    private readonly host: AvatarHost,
  ) {
    const heading = make("h2", { textContent: "Avatar" });
    this.#takeOff.addEventListener("click", () => this.takeOff());
    this.#file.addEventListener("change", () => {
      const file = this.#file.files?.[0];
      if (file) void this.take(file);
    });
    this.#sliders = [
      this.#slider("Hair size", 1 - kSizeChange, 1 + kSizeChange, "size"),
      this.#slider("Hair height", -kShiftM, kShiftM, "height"),
      this.#slider("Hair depth", -kShiftM, kShiftM, "depth"),
    ];
    const parts = make("details");
    parts.append(make("summary", { textContent: "Hide parts of the model" }), this.#parts);
    const reset = make("button", { type: "button", textContent: "Reset the fit" });
    reset.addEventListener("click", () => this.#reset());
    this.#controls.append(...this.#sliders.map((slider) => slider.row), parts, reset);
    section.append(heading, row("A .vrm file", this.#file, "row file"), this.#takeOff, this.#name, this.#controls);
    this.#show();
  }

  /** Wears the model of a file that the user chose or dropped. */
  async take(file: File): Promise<void> {
    await this.#load(file.name, async () => new Uint8Array(await file.arrayBuffer()));
  }

  /** Removes the model. A model that is still loading is not put on either. */
  takeOff(): void {
    ++this.#request;
    this.avatar?.dispose();
    this.avatar = null;
    this.#file.value = "";
    this.#show();
  }

  /**
   * Each frame: moves the model with `pose`, the user's head in the world, and returns the pose to send. `character`,
   * `groom`: the user's own; null while there is none.
   */
  update(character: HairCharacter | null, groom: Groom | null, pose: Pose, dtS: number): Pose {
    return this.avatar?.update(character, groom, pose, dtS) ?? pose;
  }

  /** The height of the model's head joint above its feet, m; 0 without a model. */
  get headHeight(): number {
    return this.avatar?.headHeight ?? 0;
  }

  async #load(name: string, read: () => Promise<Uint8Array>): Promise<void> {
    const request = ++this.#request;
    this.#name.textContent = `Loading ${name} …`;
    try {
      // Most visitors wear no avatar: its code is not a part of the first download.
      const { Avatar } = await import("./avatar/avatar");
      const file = await read();
      const avatar = await Avatar.load(file, this.host.stage.scene);
      if (request !== this.#request) {
        avatar.dispose();
        return;
      }
      this.avatar?.dispose();
      this.avatar = avatar;
      this.#key = RememberedFits.keyOf(file);
      this.#fit = this.#fits.get(this.#key);
      avatar.set(this.#fit);
      this.host.join();
    } catch (error) {
      this.host.showError(`${name}: ${messageOf(error)}`);
    }
    if (request === this.#request) this.#show();
  }

  #show(): void {
    const { avatar } = this;
    this.#controls.hidden = this.#takeOff.hidden = avatar === null;
    const words = avatar
      ? [
          `You wear ${isolated(avatar.name) || "a model"}. The model stays in this browser: others see your hair on a plain bust.`,
        ]
      : [
          "Wear a VRM model as your body: choose its file",
          make("span", { className: "for-mouse", textContent: ", or drop it anywhere on the page" }),
          ". Models are not uploaded.",
        ];
    this.#name.replaceChildren(...words);
    if (!avatar) return;
    for (const slider of this.#sliders) slider.refresh();
    this.#parts.replaceChildren(...avatar.meshes.slice(0, kMeshesShownMax).map((mesh, n) => this.#part(mesh, n)));
  }

  #part(mesh: Mesh, index: number): HTMLLIElement {
    const box = make("input", { type: "checkbox", checked: !mesh.visible });
    box.addEventListener("change", () => {
      const hidden = this.avatar?.meshes.flatMap((other, n) =>
        (n === index ? box.checked : !other.visible) ? [n] : [],
      );
      this.#set({ hidden: hidden ?? null });
    });
    const material = [mesh.material].flat()[0].name;
    const label = make("label", { className: "part" });
    label.append(
      box,
      `${isolated(mesh.name) || `part ${index + 1}`}${material && material !== mesh.name ? ` (${isolated(material)})` : ""}`,
    );
    const item = make("li");
    item.append(label);
    return item;
  }

  #slider(label: string, least: number, most: number, name: Setting): Slider {
    const input = make("input", { type: "range", min: String(least), max: String(most), step: "0.001", name });
    const line = row(label, input);
    const text = line.querySelector("span")!;
    const showValue = () => {
      const shown =
        name === "size" ? `${(100 * this.#fit.size).toFixed(0)} %` : `${(100 * this.#fit[name]).toFixed(1)} cm`;
      text.textContent = `${label}, ${shown}`;
      input.setAttribute("aria-valuetext", shown);
    };
    input.addEventListener("input", () => {
      this.#set({ [name]: Number(input.value) * this.#unit(name) });
      showValue();
    });
    const refresh = () => {
      input.value = String(this.#fit[name] / this.#unit(name));
      showValue();
    };
    return { row: line, refresh };
  }

  // Sliders of shifts show metres on a head of the groom's size. This is the model's size over the groom's, without the
  // change by hand: the range of the shifts grows with the model's head.
  #unit(name: Setting): number {
    return name === "size" ? 1 : (this.avatar?.vrmHair.size ?? 1) / this.#fit.size;
  }

  #set(change: Partial<RememberedFit>): void {
    this.#fit = { ...this.#fit, ...change };
    this.avatar?.set(this.#fit);
    this.#fits.put(this.#key, this.#fit);
  }

  #reset(): void {
    this.#fit = { ...kFitAsFound };
    this.#fits.forget(this.#key);
    this.avatar?.set(this.#fit);
    this.#show();
  }
}

type Setting = "size" | "height" | "depth";

interface Slider {
  readonly row: HTMLElement;
  /** Shows the current fit. */
  readonly refresh: () => void;
}

function make<K extends keyof HTMLElementTagNameMap>(
  tag: K,
  properties: Partial<HTMLElementTagNameMap[K]> = {},
): HTMLElementTagNameMap[K] {
  return Object.assign(document.createElement(tag), properties);
}

function row(label: string, input: HTMLInputElement, className = "row"): HTMLLabelElement {
  const line = make("label", { className });
  line.append(make("span", { textContent: label }), input);
  return line;
}
