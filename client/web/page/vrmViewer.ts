import { VRMLoaderPlugin, VRMUtils, type VRM } from "@pixiv/three-vrm";
import { Vector3 } from "three";
import { GLTFLoader } from "three/addons/loaders/GLTFLoader.js";
import { decodeGroom, type Groom, type Member, type OwnCharacter, type Room } from "../src/index";
import { HairScene } from "../src/scene/index";
import { VrmHair } from "../src/vrm/index";
import { AdaptiveQuality } from "./adaptiveQuality";
import type { Query } from "./query";
import { PersistentRoom } from "./persistentRoom";
import { Stage } from "./stage";

const kFaultShownMs = 8000;

const element = <T extends HTMLElement>(id: string) => document.querySelector<T>(`#${id}`)!;

/**
 * A VRM model that looks around, and has simulated hair instead of its own: that of a dropped groom file, or of the
 * first other character in the room.
 */
export class VrmViewer {
  readonly stage = new Stage(element<HTMLCanvasElement>("view"), () => ({ right: 0, bottom: 0 }));
  hair: HairScene | null = null;
  worn: VrmHair | null = null;
  model: VRM | null = null;
  /** stands still when false */
  isMoving = true;
  readonly #persistentRoom: PersistentRoom;
  readonly #quality = new AdaptiveQuality();
  #own: OwnCharacter | null = null;
  #groom: Groom | null = null;
  #file: Uint8Array | null = null;
  #timeS = 0;
  #lastMs = 0;

  constructor(private readonly query: Query) {
    this.#persistentRoom = new PersistentRoom(
      query,
      (room) => this.#enter(room),
      (state, detail) => detail && showFault(detail, state === "refused" ? Infinity : kFaultShownMs),
      showFault,
    );
    addEventListener("dragover", (event) => event.preventDefault());
    addEventListener("drop", (event) => {
      event.preventDefault();
      const file = event.dataTransfer?.files[0];
      if (file) void this.#takeFile(file);
    });
  }

  /** `model`: the bytes of a VRM file. */
  async start(model: ArrayBuffer): Promise<void> {
    await this.setModel(model);
    this.stage.renderer.setAnimationLoop((timeMs) => this.#draw(timeMs));
    await this.#persistentRoom.start();
  }

  async setModel(bytes: ArrayBuffer): Promise<void> {
    const loader = new GLTFLoader().register((parser) => new VRMLoaderPlugin(parser));
    const { userData } = await loader.parseAsync(bytes, "");
    const vrm = userData.vrm as VRM | undefined;
    if (!vrm) throw new Error("that is no VRM model");
    VRMUtils.rotateVRM0(vrm);
    this.worn?.dispose();
    if (this.model) {
      this.stage.scene.remove(this.model.scene);
      VRMUtils.deepDispose(this.model.scene);
    }
    this.model = vrm;
    this.stage.scene.add(vrm.scene);
    this.worn = new VrmHair(vrm);
    if (this.#groom) this.worn.fit(this.#groom);
    const own = [...(this.hair?.characters.values() ?? [])].find((character) => character.own);
    if (own) this.worn.wear(own);
    vrm.scene.updateWorldMatrix(true, true);
    const head = vrm.humanoid.getRawBoneNode("head")!.getWorldPosition(new Vector3());
    this.stage.orbit.target.copy(head).y += 0.02;
    this.stage.camera.position.copy(head).add(new Vector3(0.45, 0.12, 1.5));
  }

  /** Gives the model the hair of this groom file. */
  setGroom(file: Uint8Array): void {
    this.#groom = decodeGroom(file);
    this.#file = file;
    this.worn?.fit(this.#groom);
    const { room } = this.#persistentRoom;
    if (!room || this.query.observe) return;
    if (this.#own) room.removeCharacter(this.#own);
    this.#own = room.addCharacter(file);
  }

  #enter(room: Room): void {
    this.hair?.dispose();
    this.hair = new HairScene(room, this.stage.renderer, { lights: "scene" });
    this.stage.scene.add(this.hair);
    this.#own = this.#file && !this.query.observe ? room.addCharacter(this.#file) : null;
    this.hair.addEventListener("characteradded", ({ character }) => {
      if (character.own) this.worn?.wear(character);
      else character.visible = false;
    });
  }

  // Another character in the room has hair: the model gets the same.
  #borrow(room: Room): void {
    const lender = [...room.members.values()].find((member: Member) => member.groom && !member.own);
    if (!lender?.groom) return;
    this.#groom = lender.groom;
    this.worn?.fit(lender.groom);
    this.#own = room.addCharacterLike(lender);
  }

  #draw(timeMs: number): void {
    const dtS = Math.min(Math.max((timeMs - this.#lastMs) / 1000, 0), 0.1);
    this.#quality.add(timeMs - this.#lastMs);
    this.#lastMs = timeMs;
    const { stage, model, worn, hair } = this;
    const { room } = this.#persistentRoom;
    if (this.isMoving) this.#timeS += dtS;
    if (model) {
      lookAbout(model, this.#timeS);
      model.update(dtS);
    }
    if (worn && this.#own) this.#own.push(worn.pose());
    stage.orbit.update();
    if (stage.isLost) return;
    if (hair && room) {
      hair.quality = this.#quality.value;
      hair.update(stage.camera);
      if (!this.#own && !this.query.observe) this.#borrow(room);
      element("hint").hidden = this.#own !== null || this.query.observe;
    }
    stage.draw([]);
  }

  async #takeFile(file: File): Promise<void> {
    try {
      const bytes = await file.arrayBuffer();
      if (/\.groom$/i.test(file.name)) this.setGroom(new Uint8Array(bytes));
      else await this.setModel(bytes);
    } catch (fault) {
      showFault(`${file.name}: ${fault instanceof Error ? fault.message : String(fault)}`);
    }
  }
}

function lookAbout(model: VRM, timeS: number): void {
  const turn = 0.8 * Math.sin(2.2 * timeS) * Math.min(timeS, 1);
  const nod = 0.12 * Math.sin(3.1 * timeS);
  model.humanoid.getNormalizedBoneNode("neck")?.rotation.set(0.4 * nod, 0.4 * turn, 0);
  model.humanoid.getNormalizedBoneNode("head")?.rotation.set(0.6 * nod, 0.6 * turn, 0);
  model.humanoid.getNormalizedBoneNode("leftUpperArm")?.rotation.set(0, 0, -1.2);
  model.humanoid.getNormalizedBoneNode("rightUpperArm")?.rotation.set(0, 0, 1.2);
}

let faultTimer: ReturnType<typeof setTimeout> | undefined;

function showFault(detail: string, forMs = kFaultShownMs): void {
  const fault = element("fault");
  fault.textContent = detail;
  fault.hidden = false;
  clearTimeout(faultTimer);
  if (forMs < Infinity) faultTimer = setTimeout(() => (fault.hidden = true), forMs);
}
