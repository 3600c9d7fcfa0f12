import {
  Group,
  Scene,
  type Camera,
  type Color,
  type Object3D,
  type Object3DEventMap,
  type PerspectiveCamera,
  type RawShaderMaterial,
  type Vector3,
  type WebGLRenderer,
} from "three";
import { kBallMarginM, kBallShare } from "../generated/constants";
import { kRoughness } from "../hair/appearance";
import { checkOptions } from "../hair/checkOptions";
import { DroppedInput, notFinite } from "../hair/droppedInput";
import { HairnetError } from "../module/hairnetError";
import type { HairSource, MemberImportance, ShownMember } from "../hair/hairSource";
import { poseError } from "../hair/pose";
import type { Instance } from "../module/instance";
import type { DrawDetail } from "./drawDetail";
import { addEnvironment, EnvironmentLight } from "./environmentLight";
import { checkFrame, frameCamera, type FrameOptions } from "./frameCamera";
import type { GroomGeometry } from "./geometry/groomGeometry";
import { GroomBuilder } from "./groomBuilder";
import { GroomDrawing, inDrawingOrder, type DrawCounts } from "./groomDrawing";
import { HairDensityPass, type DenseGroom } from "./hairDensityPass";
import { HairCharacter } from "./hairCharacter";
import { HairMotion } from "./hairMotion";
import { SceneUniforms, type HairPart } from "./hairMaterials";
import { sceneLights, studioLights, type LightRig } from "./lightRig";
import { place } from "./placement";
import { LatticePass } from "./latticePass";
import { nodeSumFor, rendererName } from "./nodeSum";
import { Records } from "./records";
import { ShownCharacter } from "./shownCharacter";
import { SkinTexture } from "./skinTexture";
import { fitShares, StrandDeformPass, type PlacedGroom } from "./strandDeformPass";
import { CardTexture } from "./cardTexture";
import { drawnIn, furtherViews, isFiniteView, seenBy, shadowViews, viewsOf, type AnyCamera, type View } from "./view";

export interface HairSceneOptions {
  /**
   * "studio": key, fill and rim lights that turn with the camera; "scene": the directional, ambient and hemisphere
   * lights of the scene, and its environment. The default is "studio".
   */
  lights?: "studio" | "scene";
  /** Hair and busts cast shadows into the shadow maps of the scene's lights. Renderers need `shadowMap.enabled`. */
  shadows?: boolean;
  /** Called with each new material: one for every part of every groom. */
  onMaterial?: (material: RawShaderMaterial, part: HairPart) => void;
}

const kOptions: Readonly<Record<keyof HairSceneOptions, true>> = { lights: true, shadows: true, onMaterial: true };

/** Counts of the last `update`. */
export interface HairStatistics extends DrawCounts {
  characters: number;
  grooms: number;
  groomBytes: number;
  /** The GPU memory of the textures with the points of the drawn strands. */
  pointBytes: number;
  /** Cameras, places and numbers of characters that were not finite, since the scene was made. */
  inputsDropped: number;
}

/** The server learns no more often than this how large each member is on this screen. */
const kImportanceEveryMs = 250;

/** The radius of hair about the head joint while its groom's geometry is not there: that of long hair. */
const kUnknownRadiusM = 0.5;

/** The events of `HairScene.addEventListener`, by name. */
export interface HairSceneEventMap {
  characteradded: { character: HairCharacter };
  characterremoved: { character: HairCharacter };
  /** `frame` has put the camera; `centre` (world) is the point that it looks at. */
  framed: { camera: PerspectiveCamera; centre: Vector3 };
  /** A groom could not be prepared; its characters stay invisible. */
  groomerror: { groomKey: string; detail: string };
}

/**
 * The hair of all members, as a child of any three.js scene; call `update` before each rendering. Characters of one
 * groom and one drawing level are one draw call. Its world matrix may move, turn and mirror the room, and scale it
 * evenly; scaled to 0 it is hidden. Scaled unevenly it is not drawn, and the console says so.
 *
 * Numbers of the program that are not finite never end `update`: they are dropped, counted in
 * `statistics.inputsDropped`, and reported on the console.
 *
 * Drawn with multisampling (`antialias: true`, or a target with samples) nothing needs sorting; without, hair is
 * dithered. Logarithmic and reversed depth buffers are not supported.
 */
export class HairScene extends Group<Object3DEventMap & HairSceneEventMap> {
  /** The characters by member number. Each is a child of this group. */
  readonly characters = new Map<number, HairCharacter>();
  /** Multiplies all light. */
  exposure = 1;
  /** Factor on the detail that the screen size determines: strands, points; 0.1 to 4. */
  quality = 1;
  /** Which lights the hair has (`HairSceneOptions.lights`). */
  lights: "studio" | "scene";
  /** Light is followed through hair as it moves; otherwise through hair at rest, which costs less. */
  lightFollowsHair = true;
  readonly statistics: HairStatistics = {
    drawCalls: 0,
    strands: 0,
    vertices: 0,
    characters: 0,
    grooms: 0,
    groomBytes: 0,
    pointBytes: 0,
    inputsDropped: 0,
  };

  readonly #source: HairSource;
  readonly #renderer: WebGLRenderer;
  readonly #options: HairSceneOptions;
  readonly #records = new Records();
  readonly #lattices = new LatticePass(this.#records.texture);
  /** Deforms the strands of all drawn characters, and writes their points into a texture. */
  readonly #placement = new StrandDeformPass(this.#records.texture, this.#lattices.texture);
  readonly #uniforms = new SceneUniforms(this.#records.texture, this.#lattices.texture, this.#placement.texture);
  readonly #density = new HairDensityPass(this.#records.texture, this.#placement.texture, this.#uniforms.rig);
  readonly #environment = new EnvironmentLight();
  readonly #rendererName: string;
  /** The module that has the grooms of this frame; null until a first groom has arrived. */
  #module: Instance | null = null;
  readonly #cardTexture = new CardTexture();
  readonly #builder = new GroomBuilder();
  /** The grooms of the members of this frame, by their keys. */
  readonly #grooms = new Map<string, GroomEntry>();
  /** The numbers of the members of this frame, for finding those that left. */
  readonly #here = new Set<number>();
  /** What the pictures need of each character, by member number. */
  readonly #all = new Map<number, ShownCharacter>();
  /** The characters that have a finite place in this frame, drawn or not. */
  readonly #shown: ShownCharacter[] = [];
  /** Reports for the server about characters that cannot be placed: scaled to 0, or at a place that is wrong. */
  readonly #unplaced: MemberImportance[] = [];
  readonly #dropped = new DroppedInput();
  /** For `Picture`. */
  readonly motion = new HairMotion(this.#records);
  /** The last call of `frame`, until all characters that it asks for can be drawn. */
  #framing: { camera: PerspectiveCamera; options: FrameOptions } | null = null;
  /** The time of the last report to the server (`MemberImportance`), by the clock of `updateAt`. */
  #importanceMs = -Infinity;
  #isDisposed = false;

  /** Throws for three.js's WebGPURenderer. */
  constructor(source: HairSource, renderer: WebGLRenderer, options: HairSceneOptions = {}) {
    super();
    checkOptions(options, kOptions, "HairScene");
    if (typeof source?.sample !== "function")
      throw new HairnetError("invalid", "HairScene needs a room: new HairScene(await connect(address), renderer)");
    if ((renderer as { isWebGPURenderer?: boolean } | undefined)?.isWebGPURenderer)
      throw new HairnetError(
        "unsupported",
        "hair needs three.js's WebGLRenderer: WebGPURenderer cannot draw its shaders",
      );
    if (typeof renderer?.render !== "function")
      throw new HairnetError("invalid", "HairScene needs the renderer: new HairScene(room, renderer)");
    this.name = "hairnet";
    this.#source = source;
    this.#renderer = renderer;
    this.#rendererName = rendererName(renderer);
    this.#options = options;
    this.lights = options.lights ?? "studio";
    this.#uniforms.all.card_texture.value = this.#cardTexture.texture;
    this.#uniforms.all.light_depth_now.value = this.#density.textures.now;
    this.#uniforms.all.light_depth_rest.value = this.#density.textures.rest;
    renderer.domElement.addEventListener("webglcontextrestored", this.#onRestored);
  }

  /**
   * Updates all characters to their present state, for pictures from `camera` and from further cameras: a second view,
   * a mirror's camera, a cube camera. Servers learn what `camera` sees; the studio's lights stand about it.
   */
  update(camera: Camera, ...moreCameras: AnyCamera[]): void {
    this.updateAt(performance.now(), camera, ...moreCameras);
  }

  /** The same for their state at `nowMs`, a time of `performance.now()`. */
  updateAt(nowMs: number, camera: Camera, ...moreCameras: AnyCamera[]): void {
    if (this.#isDisposed) return;
    this.updateWorldMatrix(true, false);
    camera.updateWorldMatrix(true, false);
    this.#builder.onPicture();
    const members = this.#source.sample(nowMs);
    // A source may be another room's by now.
    this.#module = members.find(({ groom }) => groom)?.groom?.module ?? this.#module;
    this.#meet(members);
    const views = this.#finiteViews(viewsOf(this.#renderer, camera));
    const further = this.#finiteViews(furtherViews(this.#renderer, moreCameras));
    // Without a finite camera nothing can be placed: the draw calls of the last frame stay.
    if (views.length > 0) {
      this.#appear(members, views, [...further, ...(this.#castsShadows ? shadowViews(rootOf(this)) : [])]);
      this.#frame();
      this.#setUniforms(camera);
      this.#write();
      this.#reportImportance(nowMs);
    }
    this.statistics.inputsDropped = this.#dropped.count;
  }

  #finiteViews(views: readonly View[]): View[] {
    return views.filter((view) => {
      const isUsable = isFiniteView(view);
      if (!isUsable) this.#dropped.drop("a camera's matrix is not finite");
      return isUsable;
    });
  }

  /** A number that a program set; its default where it is not finite. */
  #finite(value: number, otherwise: number, what: string): number {
    if (Number.isFinite(value)) return value;
    this.#dropped.drop(`${what} is ${value}`);
    return otherwise;
  }

  /**
   * Puts the camera in front of all characters, or of one, so near that they just fill the picture. Characters arrive
   * over the network: `update` places the camera as soon as they are here, until each of them can be drawn. The event
   * "framed" tells the centre of the picture, for `controls.target`. A later call replaces this one.
   */
  frame(camera: PerspectiveCamera, options: FrameOptions = {}): void {
    checkFrame(camera, options);
    this.#framing = { camera, options };
    this.#frame();
  }

  /** The lights of the last picture. */
  get rig(): LightRig {
    return this.#uniforms.rig;
  }

  /** For `Picture`: the random numbers of the hair's coverage, others for each picture of an average; by default 0. */
  set ditherSeed(seed: number) {
    this.#uniforms.all.dither_seed.value = seed;
  }

  /** Leaves its parent and frees all its GPU memory. */
  override dispose(): void {
    this.#isDisposed = true;
    this.dispatchEvent({ type: "dispose" });
    this.#renderer.domElement.removeEventListener("webglcontextrestored", this.#onRestored);
    this.removeFromParent();
    this.#builder.dispose();
    for (const groom of this.#grooms.values()) disposeGroom(groom);
    this.#grooms.clear();
    for (const character of this.characters.values()) this.remove(character);
    this.characters.clear();
    this.#cardTexture.dispose();
    this.#placement.dispose();
    this.#density.dispose();
    this.#records.dispose();
    this.#lattices.dispose();
    this.motion.dispose();
  }

  /**
   * three.js uploads its textures again after a lost context. The card texture and the lattices' nodes are drawn by the
   * GPU, so they must be drawn again.
   */
  readonly #onRestored = () => {
    this.#cardTexture.forget();
    this.#records.forget();
  };

  // Adds and removes characters with their members, and grooms with their characters.
  #meet(members: readonly ShownMember[]): void {
    const here = this.#here;
    here.clear();
    for (const groom of this.#grooms.values()) groom.isWorn = false;
    for (const member of members) {
      here.add(member.member);
      const before = this.characters.get(member.member);
      // A new server may give an own character's number to another member.
      if (before && before.own !== member.own) this.#removeCharacter(before);
      const known = this.characters.get(member.member);
      if (known) known.groomKey = member.groomKey;
      else this.#addCharacter(member);
      this.characters.get(member.member)?.follow(member.appearance);
      if (member.groom && !this.#grooms.has(member.groomKey)) this.#addGroom(member.groomKey, member.groom);
      const groom = this.#grooms.get(member.groomKey);
      if (groom) groom.isWorn = true;
      if (groom && member.skin) groom.skin.fill(member.skin);
    }
    for (const [number, character] of this.characters) if (!here.has(number)) this.#removeCharacter(character);
    for (const [key, groom] of this.#grooms) {
      if (groom.isWorn) continue;
      disposeGroom(groom);
      this.#grooms.delete(key);
    }
  }

  #addCharacter(member: ShownMember): void {
    const character = new HairCharacter(member.member, member.own, member.groomKey);
    this.characters.set(member.member, character);
    this.#all.set(member.member, new ShownCharacter(character));
    this.add(character);
    this.dispatchEvent({ type: "characteradded", character });
  }

  #removeCharacter(character: HairCharacter): void {
    this.characters.delete(character.member);
    this.#all.delete(character.member);
    this.remove(character);
    this.dispatchEvent({ type: "characterremoved", character });
  }

  #addGroom(key: string, groom: NonNullable<ShownMember["groom"]>): void {
    const entry: GroomEntry = { drawing: null, isWorn: true, shown: [], skin: new SkinTexture() };
    this.#grooms.set(key, entry);
    const show = (geometry: GroomGeometry): void => {
      // The groom may have been removed meanwhile, or removed and added again.
      if (this.#isDisposed || this.#grooms.get(key) !== entry) return;
      const adapt = this.#options.onMaterial ?? (() => {});
      entry.drawing?.dispose();
      entry.drawing = new GroomDrawing(geometry, this, this.#uniforms, adapt, this.#options.shadows, entry.skin);
    };
    this.#builder.build(groom.file, show).then(show, (error: Error) => {
      if (!this.#isDisposed) this.dispatchEvent({ type: "groomerror", groomKey: key, detail: error.message });
    });
  }

  // Places every member, and chooses its detail. `views` are those of the main camera: they alone decide what the
  // server learns. `further` are other cameras and shadow maps: a character that only they see is drawn too.
  #appear(members: readonly ShownMember[], views: readonly View[], further: readonly View[]): void {
    const allViews = [...views, ...further];
    for (const one of this.#shown) one.isShown = false;
    this.#shown.length = 0;
    this.#unplaced.length = 0;
    const quality = this.#finite(this.quality, 1, "quality");
    for (const groom of this.#grooms.values()) groom.shown.length = 0;
    if (this.#module) this.#records.begin(this.#module, members);
    for (let number = 0; number < members.length; ++number) {
      const member = members[number];
      const one = this.#all.get(member.member);
      // A faulty source may name a member twice: the second one is ignored.
      if (!one || one.isShown) continue;
      const { character } = one;
      const drawing = this.#grooms.get(member.groomKey)?.drawing ?? null;
      const pose = member.pose && !poseError(member.pose) ? member.pose : null;
      character.isReady = drawing !== null && pose !== null;
      if (!pose) continue;
      const placed = place(character, pose, this.matrixWorld);
      if (typeof placed === "string") {
        this.#unplaced.push({ member: member.member, screenHeight: 0, inView: false });
        if (placed.endsWith("not finite")) this.#dropped.drop(placed);
        else if (placed !== "hidden") this.#dropped.tellOnce(placed);
        continue;
      }
      const size = Math.abs(placed.size);
      // The ball contains the hair however it swings (ball_radius_m of client/draw/groom_geometry.hpp). Without a
      // geometry the groom counts as one of kUnknownRadiusM.
      one.ballRadiusM = kBallShare * (drawing?.radiusM ?? kUnknownRadiusM) + kBallMarginM;
      const radius = one.ballRadiusM * size;
      const seen = seenBy(views, placed.pose, radius, size);
      const drawn = further.length === 0 ? seen : drawnIn(allViews, placed.pose, radius, size);
      one.member = member;
      one.number = number;
      one.pose = placed.pose;
      one.size = placed.size;
      one.screenHeight = seen.screenHeight;
      one.inView = seen.inView;
      one.drawing = drawing;
      one.isDrawn = drawing !== null && drawn.inView && isVisible(character);
      one.isShown = true;
      this.#shown.push(one);
      if (one.isDrawn) this.#records.measure(number, drawn.headPx, drawing!.strandCount);
    }
    if (!this.#module) return;
    this.#records.chooseDetails(quality);
    // A picture has at most as many records as a texture has rows. Further characters are not drawn.
    let left = this.#renderer.capabilities.maxTextureSize;
    for (const one of this.#shown) {
      if (!one.isDrawn || left-- <= 0) continue;
      this.#records.readDetail(one.number, one.detail);
      if (one.character.detail) this.#takeDetail(one.character.detail, one.detail);
      one.list = one.drawing!.listFor(one.detail.toleranceM);
      this.#grooms.get(one.member.groomKey)!.shown.push(one);
    }
  }

  // Does what the last call of `frame` asks for, as far as its characters are here. The request ends when each of them
  // can be drawn.
  #frame(): void {
    if (!this.#framing) return;
    const { camera, options } = this.#framing;
    const wanted = this.#shown.filter(({ member }) => options.member === undefined || member.member === options.member);
    if (wanted.length === 0) return;
    const framed = wanted.map(({ pose, size, member }) => ({ pose, size, groom: member.groom }));
    const centre = frameCamera(camera, framed, options.margin);
    if (!centre) return this.#dropped.drop("frame: the camera's field of view or aspect is not finite");
    if (wanted.every(({ character }) => character.isReady)) this.#framing = null;
    this.dispatchEvent({ type: "framed", camera, centre });
  }

  // Writes lattices and records, and sets up the draw calls. The records of one groom are adjacent, and those of one
  // list of its strands too: a draw call then needs only its first record.
  #write(): void {
    const counts = this.statistics;
    counts.drawCalls = counts.strands = counts.vertices = counts.groomBytes = counts.grooms = 0;
    const rowsMax = this.#placement.rowsMax(this.#renderer);
    fitShares([...this.#grooms.values()], rowsMax);
    const hasLight = this.lightFollowsHair && this.#density.isSupported(this.#renderer);
    const placed: PlacedGroom[] = [];
    const dense: DenseGroom[] = [];
    let pointRows = 0;
    let records = 0;
    for (const { drawing, shown } of this.#grooms.values()) {
      if (!drawing) continue;
      counts.groomBytes += drawing.bytes;
      if (shown.length > 0) counts.grooms += 1;
      shown.sort(inDrawingOrder);
      const first = records;
      let points = 0;
      for (const one of shown) {
        // A character whose points no longer fit into the texture is drawn without strands.
        if (pointRows + drawing.pointRowsOf(one) > rowsMax) one.detail.strandShare = 0;
        one.firstRow = pointRows;
        one.rowCount = drawing.pointRowsOf(one);
        one.hasLight = hasLight;
        if (hasLight) points = Math.max(points, drawing.pointsOf(drawing.densityStrandsOf(one)));
        this.#takeLook(one);
        this.#records.put(one.number, records, one);
        pointRows += one.rowCount;
        records += 1;
      }
      drawing.show(shown, first, counts);
      if (drawing.showsCards) this.#cardTexture.draw(this.#renderer);
      placed.push({ drawing, first, characters: shown.length });
      dense.push({ drawing, first, characters: shown.length, points });
    }
    counts.characters = records;
    if (!this.#module) return;
    const { maxTextureSize } = this.#renderer.capabilities;
    const data = this.#records.write(nodeSumFor(this.#module, this.#rendererName), maxTextureSize);
    this.#lattices.run(this.#renderer, data);
    counts.groomBytes += this.#lattices.basisBytes;
    this.#placement.place(this.#renderer, placed, pointRows);
    this.#density.run(this.#renderer, dense, data.lightGrids);
    counts.pointBytes = this.#placement.bytes;
  }

  /** Takes the detail that a program set for a character instead of the chosen one, if its numbers are finite. */
  #takeDetail(wanted: DrawDetail, detail: DrawDetail): void {
    const wrong = notFinite(wanted);
    if (wrong) return this.#dropped.drop(`a character's detail: ${wrong}`);
    detail.strandShare = wanted.strandShare;
    detail.followHairCount = wanted.followHairCount;
    detail.toleranceM = wanted.toleranceM;
    detail.quadratic = wanted.quadratic;
  }

  #takeLook(one: ShownCharacter): void {
    const { character } = one;
    this.#takeColour(character.hairColour, one.hair);
    this.#takeColour(character.hairTipColour ?? character.hairColour, one.hairTip);
    this.#takeColour(character.skinColour, one.skin);
    one.roughness = this.#finite(character.roughness, kRoughness, "a character's roughness");
  }

  /** A colour that a program set; black where it is not finite. */
  #takeColour({ r, g, b }: Color, into: Color): void {
    into.r = this.#finite(r, 0, "a character's colour");
    into.g = this.#finite(g, 0, "a character's colour");
    into.b = this.#finite(b, 0, "a character's colour");
  }

  get #castsShadows(): boolean {
    return this.#options.shadows === true && this.#renderer.shadowMap.enabled;
  }

  #setUniforms(camera: Camera): void {
    const { all, rig } = this.#uniforms;
    all.exposure.value = this.#finite(this.exposure, 1, "exposure");
    const root = rootOf(this);
    this.#uniforms.setFog(root instanceof Scene ? root.fog : null);
    if (this.lights === "scene") {
      sceneLights(root, rig);
      const environment = root instanceof Scene ? this.#environment.of(this.#renderer, root) : null;
      if (environment) addEnvironment(rig, environment, (root as Scene).environmentIntensity);
    }
    // In a headset the lights do not move: lights that turn with the head look wrong. A black key light means that the
    // studio has set no lights yet.
    else if (this.#module && (!this.#renderer.xr.isPresenting || rig.colours[0].r === 0))
      studioLights(this.#module, camera, rig);
  }

  /** Tells the source how large each member is in the main views, at most every kImportanceEveryMs. */
  #reportImportance(nowMs: number): void {
    if (!(nowMs - this.#importanceMs >= kImportanceEveryMs)) return;
    this.#importanceMs = nowMs;
    const placed = this.#shown.map(({ member: { member }, screenHeight, inView }) => ({
      member,
      screenHeight,
      inView,
    }));
    this.#source.reportImportance?.([...placed, ...this.#unplaced]);
  }
}

function disposeGroom({ drawing, skin }: GroomEntry): void {
  drawing?.dispose();
  skin.dispose();
}

interface GroomEntry {
  /** Null until the first geometry is made. The first one has few strands, and a later one replaces it. */
  drawing: GroomDrawing | null;
  /** The skin that the hair of this groom is kept out of. */
  readonly skin: SkinTexture;
  /** A member of this frame has this groom. A groom without such a member is disposed. */
  isWorn: boolean;
  /** The characters of this frame that are drawn with this groom. */
  readonly shown: ShownCharacter[];
}

function isVisible(character: HairCharacter): boolean {
  for (let at: Object3D | null = character; at; at = at.parent) if (!at.visible) return false;
  return true;
}

function rootOf(object: Object3D): Object3D {
  return object.parent ? rootOf(object.parent) : object;
}
