import { Sphere, Vector3 } from "three";
import type { MaterialScale, OwnCharacter, People, Room, Wind, WindOptions } from "../src/index";
import { HairScene } from "../src/scene/index";
import { AdaptiveQuality } from "./adaptiveQuality";
import { AvatarPanel } from "./avatarPanel";
import { closedWords, refusedWords } from "./errorWords";
import { Focus, type Shown } from "./focus";
import type { Covered } from "./framing";
import { Graph } from "./graph";
import { isolated } from "./isolated";
import { listenForGrabs } from "./headGrab";
import { offerHeadset } from "./headset";
import { Identity } from "./identity";
import { ImportNote } from "./importNote";
import { kConnecting, LoadingLine, loadingWords } from "./loadingLine";
import { MemberList } from "./memberList";
import { NameLabels } from "./nameLabels";
import { kHeadMiddleM } from "./head/headPose";
import { OwnHead } from "./head/ownHead";
import type { PageHost } from "./pageHost";
import { PersistentRoom, type PersistentRoomState } from "./persistentRoom";
import type { Query } from "./query";
import { PlayPanel } from "./playPanel";
import { givenName, personName, transportName } from "./roomDetails";
import { Sliders } from "./sliders";
import { Stage } from "./stage";
import { fadeBust, kBustHeightM } from "./surroundings";
import { TouchPanel } from "./touchPanel";
import { Touching } from "./touching";
import { HairstylePicker } from "./hairstylePicker";

/** An error message disappears after this time, unless its caller asks for another one. */
const kErrorShownMs = 8000;
/** The line of figures, the graph and the list of members are refreshed no more often than this. */
const kFiguresEveryMs = 500;
/** In a window this narrow the panel starts folded. */
const kNarrowPx = 640;
/** A pointer that moves further than this between press and release drags, and does not click. */
const kClickPx = 5;
/** After a pause, such as a hidden tab, the own head and its avatar move on by at most this time. */
const kStepMaxS = 0.1;
/** Flights accept a longer step: on a slow machine they would otherwise take longer than their time. */
const kFlightStepMaxS = 0.5;
/** A click this near to the middle of a head means that person. */
const kPersonRadiusM = 0.17;

const element = <T extends HTMLElement>(id: string) => document.querySelector<T>(`#${id}`)!;

/** The page: a room, its picture, and the user's own head in it. */
export class PageViewer implements PageHost {
  readonly stage: Stage;
  readonly focus: Focus;
  readonly head = new OwnHead();
  readonly #sliders: Sliders;
  readonly avatar: AvatarPanel;
  readonly #identity: Identity;
  readonly #play: PlayPanel;
  readonly #touching: Touching;
  readonly #touchPanel: TouchPanel;
  /** The hair of the current room; null before the first connection. */
  hair: HairScene | null = null;
  readonly #members: MemberList;
  readonly #persistentRoom: PersistentRoom;
  readonly #hairstyles: HairstylePicker;
  readonly #imported = new ImportNote(element("import-line"), element<HTMLDetailsElement>("import-remarks"));
  readonly #quality = new AdaptiveQuality();
  readonly #graph = new Graph(element<HTMLCanvasElement>("graph"));
  readonly #labels = new NameLabels(element("labels"));
  readonly #loading = new LoadingLine(element("loading"));
  /** The own head was in the last picture. */
  #isOwnShown = false;
  /** The wind that the sliders show. */
  #wind: Wind | null = null;
  #state: PersistentRoomState = "connecting";
  /** The time of the last picture, ms; 0: there was none. */
  #lastMs = 0;
  /** The time at which the figures were last refreshed, ms, and the bytes received until then. */
  #figuresMs = 0;
  #bytesBefore = 0;
  #errorTimer: ReturnType<typeof setTimeout> | undefined;

  constructor(readonly query: Query) {
    this.#persistentRoom = new PersistentRoom(
      query,
      (room) => this.#enter(room),
      (state, detail, waitS) => this.#showState(state, detail, waitS),
      (detail) => this.showError(detail),
    );
    // The room connects while WebGL starts.
    void this.#persistentRoom.start();
    setFolded(innerWidth <= kNarrowPx);
    this.stage = new Stage(element<HTMLCanvasElement>("view"), coveredByPanel);
    this.focus = new Focus(this.stage, (person) => this.#announce(person));
    this.#identity = new Identity(element<HTMLInputElement>("name"), ({ tag, appearance }) =>
      this.own?.setAppearance(appearance ?? {}, tag),
    );
    this.#members = new MemberList(
      element<HTMLUListElement>("members"),
      (member) => this.#choose(member),
      (colour) => this.#identity.setHairColour(colour),
    );
    this.#sliders = new Sliders(
      element("sliders"),
      element("wind"),
      (scale) => this.own?.setMaterial(scale),
      (wind) => this.room?.setWind(wind),
    );
    this.#hairstyles = new HairstylePicker(
      element<HTMLSelectElement>("hairstyle"),
      this.head,
      () => this.#sliders.material,
      () => this.#identity.named([...(this.room?.members.values() ?? [])].map(givenName)),
      (detail) => this.showError(detail),
      query.local,
    );
    this.avatar = new AvatarPanel(element("avatar"), {
      stage: this.stage,
      showError: (detail) => this.showError(detail),
      // Somebody who puts on a model has hair too.
      join: () => this.#hairstyles.join(),
    });
    this.#play = new PlayPanel(element("play"), this);
    this.#touching = new Touching(this, element("touch-hint"));
    this.#touchPanel = new TouchPanel(
      this,
      this.#touching,
      element<HTMLSelectElement>("who-may-touch"),
      element<HTMLButtonElement>("unpin"),
    );
    element("room").textContent = query.local ? "this browser" : query.room ? `“${query.room}”` : "the lobby";
    // An observer has no hair of its own, and servers do not let it set the wind.
    for (const id of ["you", "avatar", "play", "hair-and-wind", "join"]) element(id).hidden = query.observe;
    // In a room without a server there is nobody else who could touch hair.
    element("touch").hidden = query.local;
    this.#listen();
  }

  get room(): People | null {
    return this.#persistentRoom.room;
  }

  get served(): Room | null {
    return this.#persistentRoom.served;
  }

  get own(): OwnCharacter | null {
    return this.#hairstyles.own;
  }

  setMaterial(scale: MaterialScale): void {
    this.#sliders.material = scale;
    this.own?.setMaterial(scale);
  }

  setWind(wind: WindOptions): void {
    this.room?.setWind(wind);
  }

  async start(): Promise<void> {
    this.stage.renderer.setAnimationLoop((timeMs) => this.#draw(timeMs));
    void offerHeadset(element("enter-vr"), this.stage.renderer, (detail) => this.showError(detail));
    if (!this.query.observe) await this.#hairstyles.start();
    // There is nobody else to look at.
    if (this.query.local) this.#hairstyles.join();
  }

  // The page is in a room: at the start, or in another one after the connection was given up.
  #enter(room: People): void {
    this.hair?.dispose();
    this.#members.clear();
    this.#isOwnShown = false;
    const hair = new HairScene(room, this.stage.renderer, { onMaterial: fadeBust });
    this.hair = hair;
    hair.exposure = Number(element<HTMLInputElement>("exposure").value);
    this.stage.scene.add(hair);
    hair.addEventListener("characteradded", ({ character }) => this.#members.add(character));
    hair.addEventListener("characterremoved", ({ character }) => this.#members.remove(character));
    hair.addEventListener("groomerror", ({ detail }) => this.showError(`A hairstyle cannot be drawn: ${detail}`));
    this.served?.fetchFirst(this.focus.person);
    this.#hairstyles.enter(room);
    if (this.served) this.#touching.enter(this.served);
  }

  #draw(timeMs: number): void {
    const { stage, hair, room } = this;
    const dtMs = this.#lastMs > 0 ? timeMs - this.#lastMs : 16;
    const dtS = Math.min(Math.max(dtMs / 1000, 0), kStepMaxS);
    this.#lastMs = timeMs;
    this.#quality.add(dtMs);
    const isInVr = stage.renderer.xr.isPresenting;
    const shown = this.#shown();
    // Otherwise a headset moves the camera, or the user drags the own head and the view must stand still.
    if (!isInVr && stage.orbit.enabled) {
      // A flight lasts as long at a low frame rate as at a high one.
      const spanS = Math.min(Math.max(dtMs / 1000, 0), kFlightStepMaxS);
      this.focus.update(shown, (room?.members.size ?? 0) - shown.length, spanS);
      stage.motion.update(spanS);
    }
    if (stage.isLost) return;
    // The head is read right before drawing: every earlier reading would add latency to its motion.
    const head = isInVr
      ? this.head.ofHeadset(stage.renderer.xr, stage.rig.matrixWorld)
      : this.head.update(dtS, stage.camera);
    const own = shown.find(({ member }) => member.own);
    this.own?.push(this.avatar.update(own?.character ?? null, own?.member.groom ?? null, head, dtS));
    if (hair && room) {
      if (this.served) this.served.fetchesOnlyFirst = stage.firstPictures.holdsOthers;
      hair.lightFollowsHair = !stage.firstPictures.isBeforeHair;
      hair.quality = stage.detailFor(this.#quality.value);
      if (!isInVr) this.#play.beforeDraw();
      hair.update(stage.camera, ...this.#play.cameras);
    }
    const drawn = shown.filter(({ character }) => character.isReady);
    this.#touchPanel.update();
    this.#touching.update(drawn);
    if (drawn.length === 0 && (this.served?.downloads.byteCount ?? 0) > 0) stage.warmUpShaders();
    stage.draw(
      hair,
      drawn.map(({ member, character }) => ({
        head: character.position,
        height: Math.max(kBustHeightM * character.scale.y, member.own ? this.avatar.headHeight : 0),
      })),
    );
    if (!isInVr) this.#labels.update(drawn, stage.camera, stage.free, stage.size);
    if (drawn.length > 0) stage.standAt(drawn.reduce((sum, one) => sum + one.character.position.y, 0) / drawn.length);
    this.#showOwn(drawn);
    this.#showLoading();
    stage.firstPictures.add(dtMs, {
      hasPeople: (room?.members.size ?? 0) > 0,
      hasHair: drawn.length > 0,
      isWaiting: this.#loading.isShown,
    });
    if (timeMs - this.#figuresMs > kFiguresEveryMs) this.#showFigures(timeMs);
  }

  /** Everyone with a pose, as of the last picture. */
  #shown(): Shown[] {
    const { room, hair } = this;
    if (!room || !hair) return [];
    return [...room.members.values()].flatMap((member) => {
      const character = hair.characters.get(member.member);
      return character && member.pose ? [{ member, character }] : [];
    });
  }

  // When the own head appears for the first time, the camera flies to it: users who join look for themselves.
  #showOwn(drawn: readonly Shown[]): void {
    const own = drawn.find(({ member }) => member.own);
    if (own && !this.#isOwnShown) this.focus.show(own.member.member);
    this.#isOwnShown = own !== undefined;
  }

  #choose(member: number): void {
    if (this.focus.person === member) this.focus.showAll();
    else this.focus.show(member);
  }

  #announce(person: number | null): void {
    const member = person === null ? undefined : this.room?.members.get(person);
    this.served?.fetchFirst(person);
    element("shown").textContent = member ? `Showing ${personName(member)}` : "Showing everyone";
  }

  #listen(): void {
    const { query, stage } = this;
    const quality = element<HTMLSelectElement>("quality");
    quality.addEventListener(
      "change",
      () => (this.#quality.chosen = quality.value === "auto" ? null : Number(quality.value)),
    );
    const exposure = element<HTMLInputElement>("exposure");
    exposure.addEventListener("input", () => {
      element("exposure-value").textContent = `× ${Number(exposure.value).toFixed(1)}`;
      if (this.hair) this.hair.exposure = Number(exposure.value);
    });
    element("fold").addEventListener("click", () => setFolded(!element("panel").classList.contains("folded")));
    new ResizeObserver(() => stage.resize()).observe(element("panel"));
    const calm = matchMedia("(prefers-reduced-motion: reduce)");
    const listenToCalm = () => {
      stage.motion.isReduced = calm.matches;
      if (calm.matches) stage.motion.stop();
    };
    calm.addEventListener("change", listenToCalm);
    listenToCalm();
    element("show-all").addEventListener("click", () => this.focus.showAll());
    this.#listenToView();
    addEventListener("dragover", (event) => event.preventDefault());
    addEventListener("drop", (event) => {
      event.preventDefault();
      this.#takeFiles([...(event.dataTransfer?.files ?? [])]);
    });
    if (query.observe) return;
    listenForGrabs(
      stage,
      this.head,
      () => this.own !== null,
      () => this.#touching.isPressed,
    );
    const followView = element<HTMLInputElement>("follow-view");
    followView.addEventListener("change", () => (this.head.followsView = followView.checked));
    const chooser = element<HTMLInputElement>("groom-file");
    chooser.addEventListener("change", () => this.#takeFiles([...(chooser.files ?? [])]));
    element("join-button").addEventListener("click", () => {
      if (this.#hairstyles.hasHairstyle) void this.#hairstyles.choose(null);
      else this.#hairstyles.join();
    });
  }

  // A click or tap on a person flies there; a double click and Escape go back to everyone.
  #listenToView(): void {
    const { stage, focus } = this;
    const { canvas } = stage;
    let down: PointerEvent | null = null;
    canvas.addEventListener("pointerdown", (event) => (down = event.isPrimary ? event : null));
    canvas.addEventListener("pointerup", (event) => {
      const moved = down ? Math.hypot(event.clientX - down.clientX, event.clientY - down.clientY) : Infinity;
      down = null;
      if (moved > kClickPx || event.button !== 0) return;
      const person = this.#personAt(event);
      if (person !== null) focus.show(person);
    });
    canvas.addEventListener("dblclick", () => focus.showAll());
    canvas.addEventListener("keydown", (event) => {
      if (event.ctrlKey || event.metaKey || event.altKey || event.defaultPrevented) return;
      if (event.key === "Home") focus.restart();
      else if (stage.motion.onKey(event.key)) stage.isMoved = true;
      else return;
      event.preventDefault();
    });
    addEventListener("keydown", (event) => {
      if (event.key === "Escape" && !(event.target instanceof HTMLSelectElement)) focus.showAll();
    });
  }

  // The member number of the nearest person whose head is under the pointer; null: there is none.
  #personAt(event: PointerEvent): number | null {
    const ray = this.stage.rayAt(event);
    let nearest = Infinity;
    let person: number | null = null;
    for (const { member, character } of this.#shown()) {
      const head = new Sphere(character.position.clone().add(new Vector3(0, kHeadMiddleM, 0)), kPersonRadiusM);
      const hit = ray.intersectSphere(head, new Vector3());
      const distance = hit?.distanceTo(ray.origin) ?? Infinity;
      if (distance >= nearest) continue;
      nearest = distance;
      person = member.member;
    }
    return person;
  }

  // A model becomes the avatar of the user. All other files together make one hairstyle.
  #takeFiles(files: readonly File[]): void {
    if (this.query.observe && files.length > 0)
      return this.showError("You only watch this room: open its address without “observe” to wear hair.");
    const isModel = ({ name }: File) => /\.(vrm|glb|gltf)$/i.test(name);
    const model = files.find(isModel);
    if (model) void this.avatar.take(model);
    const hair = files.filter((file) => !isModel(file));
    if (hair.length === 0) return;
    this.#imported.showReading(hair.map(({ name }) => name));
    void this.#hairstyles.takeFiles(hair, (remarks) => this.#imported.show(remarks));
  }

  // Shows what the page waits for. Members who cannot be shown, or have a groom and no pose, are not waited for.
  #showLoading(): void {
    const { room, hair } = this;
    if (this.#state === "closed" || this.#state === "refused") return this.#loading.show(null);
    let [people, withGroom, ready] = [0, 0, 0];
    for (const member of room?.members.values() ?? []) {
      if (member.error || (member.groom && !member.pose)) continue;
      ++people;
      if (member.groom) ++withGroom;
      if (hair?.characters.get(member.member)?.isReady) ++ready;
    }
    // In a local room the own hair is the only hair: the user waits for it as soon as a hairstyle is chosen.
    if (this.query.local && people === 0 && this.#hairstyles.hasHairstyle) people = 1;
    const downloads = this.served?.downloads ?? { bytes: 0, byteCount: 0 };
    const building = this.#persistentRoom.local?.building ?? null;
    this.#loading.show(loadingWords({ isConnected: room !== null, people, withGroom, ready, downloads, building }));
  }

  // Refreshes what changes slowly: the hint of an empty room, the list of members, the wind, and the line of figures.
  #showFigures(timeMs: number): void {
    const spanS = (timeMs - this.#figuresMs) / 1000;
    this.#figuresMs = timeMs;
    const { room, hair } = this;
    element("hint").hidden = !(
      room?.members.size === 0 &&
      this.#hairstyles.isAcquainted &&
      !this.#hairstyles.hasHairstyle
    );
    element("hint").textContent = this.query.observe
      ? "Nobody is here yet. Others appear as soon as they join this room."
      : `Nobody is here${this.query.local ? "" : " yet"}. Join with hair on, or give a file of hair, to be the first.`;
    this.#showJoin();
    if (!room || !hair) return;
    this.#members.refresh(room, hair.characters, this.focus.person);
    element("show-all").hidden = room.members.size < 2;
    this.#showWind(room);
    if (!this.query.observe) this.#hairstyles.offer();
    const bytesReceived = this.served?.counters.bytesReceived ?? 0;
    const rate = Math.max(bytesReceived - this.#bytesBefore, 0) / 1000 / spanS;
    this.#bytesBefore = bytesReceived;
    const delays = [...room.members.values()].map((member) => 1000 * member.delayS).filter((ms) => ms > 0);
    const delay = delays.length > 0 ? delays.sort((a, b) => a - b)[delays.length >> 1] : null;
    this.#graph.add(delay, rate);
    const { drawCalls, strands } = hair.statistics;
    const { transport, fallbackReason } = this.served?.link ?? { transport: null, fallbackReason: null };
    const behind = delay === null ? "no frames" : `${delay.toFixed(0)} ms behind`;
    const line = `${behind}, ${rate.toFixed(0)} kB/s, ${transportName(transport, fallbackReason)}`;
    element("figures").textContent =
      `${this.query.local ? "simulated in this browser" : line}, ${drawCalls} draw calls, ` +
      `${strands} strands, quality ${this.#quality.value.toFixed(2)}`;
  }

  #showJoin(): void {
    const join = element<HTMLButtonElement>("join-button");
    const hasHairstyle = this.#hairstyles.hasHairstyle;
    join.textContent = hasHairstyle ? "Leave the picture" : "Join with hair on";
    join.classList.toggle("primary", !hasHairstyle);
    join.disabled = !this.room || (!hasHairstyle && !this.#hairstyles.canJoin);
  }

  #showWind(room: People): void {
    if (room.wind === this.#wind) return;
    this.#wind = room.wind;
    this.#sliders.showWind(room.wind);
  }

  #showState(state: PersistentRoomState, detail: string, waitS: number): void {
    const texts = {
      connecting: "connecting",
      connected: this.query.local ? "no server" : "connected",
      reconnecting: "reconnecting",
      closed: "server gone",
      refused: "refused",
    };
    this.#state = state;
    // The animation loop shows this line only from the first frame on, and the connection starts before.
    if (state === "connecting") this.#loading.show(kConnecting);
    const shown = element("state");
    shown.dataset.state = state;
    shown.textContent = texts[state];
    shown.title = isolated(detail);
    if (state === "closed") {
      this.#hairstyles.leave();
      this.showError(closedWords(this.query.server, detail, waitS), Infinity);
    }
    if (state === "refused") this.showError(refusedWords(detail, this.query.token !== ""), Infinity);
    if (state === "connected") element("error").hidden = true;
  }

  showError(detail: string, forMs = kErrorShownMs): void {
    const error = element("error");
    error.textContent = detail;
    error.hidden = false;
    clearTimeout(this.#errorTimer);
    if (forMs < Infinity) this.#errorTimer = setTimeout(() => (error.hidden = true), forMs);
  }
}

function setFolded(isFolded: boolean): void {
  element("panel").classList.toggle("folded", isFolded);
  element("fold").setAttribute("aria-expanded", String(!isFolded));
}

/** A folded panel in a corner covers nothing that matters. */
function coveredByPanel(): Covered {
  const panel = element("panel").getBoundingClientRect();
  if (panel.width > 0.9 * innerWidth) return { right: 0, bottom: panel.height };
  const isFolded = element("panel").classList.contains("folded");
  return { right: isFolded ? 0 : panel.width + 12, bottom: 0 };
}
