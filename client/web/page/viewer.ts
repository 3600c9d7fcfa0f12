import { Vector3 } from "three";
import type { HairCharacter } from "../src/scene/index";
import { HairScene } from "../src/scene/index";
import { Member, type MaterialScale, type OwnCharacter, type Room, type Wind } from "../src/index";
import { Graph } from "./graph";
import { fileHairstyle, listedHairstyles, roomHairstyles, type Hairstyle } from "./hairstyles";
import { listenForGrabs } from "./headGrab";
import { offerHeadset } from "./headset";
import { MemberList } from "./memberList";
import { OwnHead } from "./ownHead";
import { AdaptiveQuality } from "./adaptiveQuality";
import type { Query } from "./query";
import { PersistentRoom, type PersistentRoomState } from "./persistentRoom";
import { Sliders } from "./sliders";
import { PlayPanel } from "./play/playPanel";
import { kHeadInVrM, Stage } from "./stage";

const kFaultShownMs = 8000;
const kFiguresEveryMs = 500;
const kPlaceApartM = 0.6;
const kAcquaintedMs = 700;

const element = <T extends HTMLElement>(id: string) => document.querySelector<T>(`#${id}`)!;

/** The page: a room, its picture, and the user's own head in it. */
export class PageViewer {
  readonly stage: Stage;
  readonly members = new MemberList(element<HTMLUListElement>("members"));
  hair: HairScene | null = null;
  readonly #persistentRoom: PersistentRoom;
  readonly head = new OwnHead();
  readonly #quality = new AdaptiveQuality();
  readonly #graph = new Graph(element<HTMLCanvasElement>("graph"));
  readonly #sliders: Sliders;
  readonly #play: PlayPanel | null;
  #own: OwnCharacter | null = null;
  #wanted: Hairstyle | null = null;
  #acquainted: Promise<void> = Promise.resolve();
  #listed: Hairstyle[] = [];
  #files: Hairstyle[] = [];
  #offered: Hairstyle[] = [];
  readonly #framed = new Set<number>();
  #lastMs = 0;
  #figuresMs = 0;
  #bytesBefore = 0;
  #faultTimer: ReturnType<typeof setTimeout> | undefined;

  constructor(readonly query: Query) {
    this.stage = new Stage(element<HTMLCanvasElement>("view"), () => coveredByPanel());
    this.#persistentRoom = new PersistentRoom(
      query,
      (room) => this.#enter(room),
      (state, detail) => this.#showState(state, detail),
      (detail) => this.showFault(detail),
    );
    this.#sliders = new Sliders(
      element("sliders"),
      (scale) => this.#own?.setMaterial(scale),
      (wind) => this.room?.setWind(wind),
    );
    this.#play = query.observe ? null : new PlayPanel(element("play"), this);
    element("room").textContent = query.room || "(lobby)";
    // An observer has no hair of its own, and servers do not let it set the wind.
    for (const id of ["you", "hair-and-wind", "play"]) element(id).hidden = query.observe;
    this.#listen();
  }

  get own(): OwnCharacter | null {
    return this.#own;
  }

  setMaterial(scale: MaterialScale): void {
    this.#sliders.material = scale;
    this.#own?.setMaterial(scale);
  }

  setWind(wind: Wind): void {
    this.room?.setWind(wind);
  }

  get room(): Room | null {
    return this.#persistentRoom.room;
  }

  async start(): Promise<void> {
    this.stage.renderer.setAnimationLoop((timeMs) => this.#draw(timeMs));
    void offerHeadset(element("enter-vr"), this.stage.renderer, (detail) => this.showFault(detail));
    void this.#persistentRoom.start();
    if (this.query.observe) return;
    this.#listed = await listedHairstyles();
    this.#offerHairstyles();
  }

  #enter(room: Room): void {
    this.hair?.dispose();
    this.members.clear();
    this.#framed.clear();
    this.#own = null;
    this.#acquainted = new Promise((done) => setTimeout(done, kAcquaintedMs));
    const hair = new HairScene(room, this.stage.renderer);
    this.hair = hair;
    hair.exposure = Number(element<HTMLInputElement>("exposure").value);
    this.stage.scene.add(hair);
    hair.addEventListener("characteradded", ({ character }) => this.members.add(character));
    hair.addEventListener("characterremoved", ({ character }) => {
      this.members.remove(character);
      this.#framed.delete(character.member);
    });
    hair.addEventListener("groomfault", ({ detail }) => this.showFault(`A hairstyle cannot be drawn: ${detail}`));
    // The own hairstyle carries over to the next room.
    if (this.#wanted) void this.#wear(this.#wanted);
  }

  #draw(timeMs: number): void {
    const { stage } = this;
    const dtMs = this.#lastMs > 0 ? timeMs - this.#lastMs : 16;
    this.#lastMs = timeMs;
    this.#quality.add(dtMs);
    const isInVr = stage.renderer.xr.isPresenting;
    if (!isInVr && !this.#play?.isFirstPerson) stage.orbit.update();
    if (stage.isLost) return;
    if (this.#own) {
      // Captured as late as possible, and drawn at once.
      const pose = isInVr
        ? this.head.ofHeadset(stage.renderer.xr, stage.rig.matrixWorld)
        : this.head.update(Math.min(dtMs / 1000, 0.1), stage.camera);
      this.#own.push(pose);
    }
    if (!isInVr) this.#play?.beforeDraw();
    if (this.hair && this.room) {
      this.hair.quality = this.#quality.value;
      this.hair.update(stage.camera);
      this.#follow();
    }
    stage.renderer.render(stage.scene, stage.camera);
    this.#play?.afterDraw(timeMs);
    if (timeMs - this.#figuresMs > kFiguresEveryMs) this.#showFigures(timeMs);
  }

  // Frame newcomers until the user moves the camera. A member that was clicked stays in the centre of the view.
  #follow(): void {
    const seen = [...(this.hair?.characters.values() ?? [])].filter((character) => character.isReady);
    const isNew = seen.some((character) => !this.#framed.has(character.member));
    if (isNew && !this.stage.isMoved) {
      for (const character of seen) this.#framed.add(character.member);
      this.stage.frame(seen.map((character) => character.position.clone()));
      this.stage.standAt(meanHeight(seen));
    }
    const followed = this.members.followed === null ? null : this.hair?.characters.get(this.members.followed);
    if (!followed?.isReady || this.stage.renderer.xr.isPresenting) return;
    const { orbit, camera } = this.stage;
    const step = followed.position.clone().sub(orbit.target).multiplyScalar(0.12);
    orbit.target.add(step);
    camera.position.add(step);
  }

  async #wear(hairstyle: Hairstyle | null): Promise<void> {
    this.#wanted = hairstyle;
    const { room } = this;
    if (!room) return;
    try {
      const groom = hairstyle ? await hairstyle.get() : null;
      // The server announces the members shortly after the welcome.
      await this.#acquainted;
      if (room !== this.room || hairstyle !== this.#wanted) return;
      const isFirst = this.#own === null;
      if (this.#own) room.removeCharacter(this.#own);
      this.#own = null;
      if (!groom) return;
      if (isFirst) this.#takePlace(room);
      this.#own = groom instanceof Member ? room.addCharacterLike(groom) : room.addCharacter(groom);
      this.#own.setMaterial(this.#sliders.material);
    } catch (fault) {
      this.#wanted = null;
      this.showFault(fault instanceof Error ? fault.message : String(fault));
    }
  }

  // Finds a free place beside the other characters.
  #takePlace(room: Room): void {
    const others = [...room.members.values()].flatMap(({ own, pose }) => (pose && !own ? [pose] : []));
    const height = others.length > 0 ? others.reduce((sum, pose) => sum + pose[5], 0) / others.length : kHeadInVrM;
    for (let n = 0; n < 200; ++n) {
      const side = n % 2 === 0 ? 1 : -1;
      const place = new Vector3(side * Math.ceil(n / 2) * kPlaceApartM, height, 0);
      if (others.some((pose) => Math.hypot(pose[4] - place.x, pose[6] - place.z) < kPlaceApartM - 0.05)) continue;
      this.head.placeAt(place, 0);
      return;
    }
  }

  #offerHairstyles(): void {
    const select = element<HTMLSelectElement>("hairstyle");
    this.#offered = [...this.#files, ...this.#listed, ...roomHairstyles(this.room?.members.values() ?? [])];
    const labels = ["none (watch)", ...this.#offered.map((style) => style.label)];
    const before = [...select.options].map((option) => option.text);
    if (labels.length === before.length && labels.every((label, n) => label === before[n])) return;
    const worn = this.#wanted?.label;
    select.replaceChildren(...labels.map((label) => new Option(label)));
    select.selectedIndex = Math.max(worn ? labels.indexOf(worn) : 0, 0);
  }

  async #takeFile(file: File): Promise<void> {
    try {
      const style = await fileHairstyle(file);
      this.#files = [style, ...this.#files.filter((other) => other.label !== style.label)];
      this.#wanted = style;
      this.#offerHairstyles();
      await this.#wear(style);
    } catch (fault) {
      this.showFault(`${file.name}: ${fault instanceof Error ? fault.message : String(fault)}`);
    }
  }

  #listen(): void {
    const { query } = this;
    const quality = element<HTMLSelectElement>("quality");
    quality.addEventListener(
      "change",
      () => (this.#quality.chosen = quality.value === "auto" ? null : Number(quality.value)),
    );
    const exposure = element<HTMLInputElement>("exposure");
    exposure.addEventListener("input", () => {
      if (this.hair) this.hair.exposure = Number(exposure.value);
    });
    const panel = element("panel");
    const fold = element<HTMLButtonElement>("fold");
    fold.addEventListener("click", () => {
      const isFolded = panel.classList.toggle("folded");
      fold.setAttribute("aria-expanded", String(!isFolded));
      this.stage.resize();
    });
    if (query.observe) return;
    listenForGrabs(this.stage, this.head, () => this.#own !== null);
    const select = element<HTMLSelectElement>("hairstyle");
    select.addEventListener("change", () => void this.#wear(this.#offered[select.selectedIndex - 1] ?? null));
    const followView = element<HTMLInputElement>("follow-view");
    followView.addEventListener("change", () => (this.head.followsView = followView.checked));
    const chooser = element<HTMLInputElement>("groom-file");
    chooser.addEventListener("change", () => {
      const file = chooser.files?.[0];
      if (file) void this.#takeFile(file);
    });
    addEventListener("dragover", (event) => event.preventDefault());
    addEventListener("drop", (event) => {
      event.preventDefault();
      const file = event.dataTransfer?.files[0];
      if (file) void this.#takeFile(file);
    });
  }

  #showFigures(timeMs: number): void {
    const spanS = (timeMs - this.#figuresMs) / 1000;
    this.#figuresMs = timeMs;
    const { room, hair } = this;
    element("hint").hidden = !(room && room.members.size === 0);
    element("hint").textContent = this.query.observe
      ? "Nobody is here yet. Others appear as soon as they join this room."
      : "Nobody is here yet. Choose a hairstyle, or drop a .groom file, to be the first.";
    if (!room || !hair) return;
    this.members.refresh(room, hair.characters);
    if (!this.query.observe) this.#offerHairstyles();
    const { bytesReceived } = room.counters;
    const rate = Math.max(bytesReceived - this.#bytesBefore, 0) / 1000 / spanS;
    this.#bytesBefore = bytesReceived;
    const delays = [...room.members.values()].map((member) => 1000 * room.delayS(member)).filter((ms) => ms > 0);
    const delay = delays.length > 0 ? delays.sort((a, b) => a - b)[delays.length >> 1] : null;
    this.#graph.add(delay, rate);
    const { drawCalls, strands, cards } = hair.statistics;
    const shown = `${strands > 0 || cards === 0 ? `${strands} strands` : ""}${cards > 0 ? ` ${cards} far cards` : ""}`;
    element("figures").textContent =
      `${delay === null ? "no frames" : `${delay.toFixed(0)} ms behind`}, ${rate.toFixed(0)} kB/s, ${drawCalls} draw calls, ` +
      `${shown}, quality ${this.#quality.value.toFixed(2)}`;
  }

  #showState(state: PersistentRoomState, detail: string): void {
    const texts = {
      connecting: "connecting",
      connected: "connected",
      reconnecting: "reconnecting",
      closed: "server gone",
      refused: "refused",
    };
    const shown = element("state");
    shown.dataset.state = state;
    shown.textContent = texts[state];
    shown.title = detail;
    if (state === "closed" && detail) this.showFault(`${detail}. Trying again.`);
    if (state === "refused") this.showFault(detail, Infinity);
    if (state === "connected") element("fault").hidden = true;
  }

  showFault(detail: string, forMs = kFaultShownMs): void {
    const fault = element("fault");
    fault.textContent = detail;
    fault.hidden = false;
    clearTimeout(this.#faultTimer);
    if (forMs < Infinity) this.#faultTimer = setTimeout(() => (fault.hidden = true), forMs);
  }
}

function coveredByPanel(): { right: number; bottom: number } {
  const panel = element("panel").getBoundingClientRect();
  const isSheet = panel.width > 0.9 * innerWidth;
  return isSheet ? { right: 0, bottom: panel.height } : { right: panel.width + 24, bottom: 0 };
}

function meanHeight(characters: readonly HairCharacter[]): number {
  return characters.reduce((sum, one) => sum + one.position.y, 0) / Math.max(characters.length, 1);
}
