import { LevelIndex } from "../hair/level";
import type { GroomHash } from "./groomHash";
import type {
  AddCharacter,
  ClientMessage,
  ErrorMessage,
  HairState,
  MaterialScale,
  Observe,
  SetLevel,
  SetMaterial,
  SetWind,
} from "./messages";
import { ErrorReason } from "./messages";

interface OfferedGroom {
  readonly bytes: Uint8Array;
  ready: boolean;
}

interface RequestedCharacter {
  readonly groom: GroomHash;
  level: LevelIndex;
  material: MaterialScale | null;
  /** CharacterAdded has come */
  confirmed: boolean;
}

/** What is to be said over a new connection; offers first. */
export interface Resend {
  readonly offers: (readonly [GroomHash, Uint8Array])[];
  readonly messages: ClientMessage[];
}

/**
 * What a client has asked for and what of it the server has confirmed, so that all of it can be sent again over a new
 * connection. No I/O.
 */
export class RequestedState {
  readonly #grooms = new Map<GroomHash, OfferedGroom>();
  readonly #characters = new Map<number, RequestedCharacter>();
  /** as it was when the connection broke */
  readonly #states = new Map<number, HairState>();
  /** removed, and not confirmed */
  readonly #leaving = new Set<number>();
  /** Of which the server may have heard already; it may tell of them before it refuses them. */
  readonly #sentTwice = new Set<number>();
  #wind: SetWind | null = null;
  #observe: Observe | null = null;

  get characters(): Iterable<number> {
    return this.#characters.keys();
  }

  /** Its removal may not be confirmed yet. */
  hasAskedFor(character: number): boolean {
    return this.#characters.has(character) || this.#leaving.has(character);
  }

  /** `bytes` are kept until the groom is refused. */
  offer(hash: GroomHash, bytes: Uint8Array): void {
    if (!this.#grooms.has(hash)) this.#grooms.set(hash, { bytes, ready: false });
  }

  add(added: AddCharacter): void {
    this.#sentTwice.delete(added.character);
    this.#characters.set(added.character, {
      groom: added.groom,
      level: added.level,
      material: null,
      confirmed: false,
    });
    this.#states.delete(added.character);
    if (added.state) this.#states.set(added.character, added.state);
  }

  setLevel(wanted: SetLevel): void {
    const character = this.#characters.get(wanted.character);
    if (character) character.level = wanted.level;
    if (wanted.level === LevelIndex.rigid) this.#states.delete(wanted.character);
  }

  setMaterial(wanted: SetMaterial): void {
    const character = this.#characters.get(wanted.character);
    if (character) character.material = wanted.scale;
  }

  setWind(wanted: SetWind): void {
    this.#wind = wanted;
  }

  observe(wanted: Observe): void {
    this.#observe = wanted;
  }

  remove(character: number): void {
    this.#characters.delete(character);
    this.#states.delete(character);
    this.#leaving.add(character);
  }

  /** The hair of a character is to go on from there, should the server have forgotten it. */
  remember(character: number, state: HairState): void {
    if (this.#characters.has(character)) this.#states.set(character, state);
  }

  forgetState(character: number): void {
    this.#states.delete(character);
  }

  onReady(hash: GroomHash): void {
    const groom = this.#grooms.get(hash);
    if (groom) groom.ready = true;
  }

  onRefused(hash: GroomHash): void {
    this.#grooms.delete(hash);
  }

  onAdded(character: number): void {
    const known = this.#characters.get(character);
    if (known) known.confirmed = true;
  }

  onRemoved(character: number): void {
    this.#leaving.delete(character);
  }

  /** True for an error that only says that the message had arrived before the connection broke, and was said twice. */
  onError(error: ErrorMessage): boolean {
    if (error.character === 0) return false;
    if (error.reason === ErrorReason.characterUnknown) return this.#leaving.delete(error.character);
    if (error.reason !== ErrorReason.characterExists || !this.#sentTwice.delete(error.character)) return false;
    this.onAdded(error.character);
    return true;
  }

  /** A new connection has its welcome. `resumed`: the server still has what it confirmed. */
  takeResend(resumed: boolean): Resend {
    const resend: Resend = { offers: [], messages: [] };
    this.#sentTwice.clear();
    for (const [hash, groom] of this.#grooms) {
      groom.ready &&= resumed;
      if (!groom.ready) resend.offers.push([hash, groom.bytes]);
    }
    if (!resumed) this.#leaving.clear();
    for (const character of this.#leaving) resend.messages.push({ type: "removeCharacter", character });
    for (const [number, character] of this.#characters) this.#resendCharacter(number, character, resumed, resend);
    if (this.#wind) resend.messages.push(this.#wind);
    if (this.#observe) resend.messages.push(this.#observe);
    return resend;
  }

  #resendCharacter(number: number, character: RequestedCharacter, resumed: boolean, resend: Resend): void {
    const { groom, level, material } = character;
    character.confirmed &&= resumed;
    if (!character.confirmed) {
      const state = this.#states.get(number) ?? null;
      resend.messages.push({ type: "addCharacter", character: number, groom, level, state });
      if (resumed) this.#sentTwice.add(number);
    }
    // The server may have added it before the connection broke, with an older level.
    if (resumed) resend.messages.push({ type: "setLevel", character: number, level });
    if (material) resend.messages.push({ type: "setMaterial", character: number, scale: material });
  }
}
