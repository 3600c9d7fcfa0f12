import { LevelIndex } from "../hair/level";
import { clientCodecs, codecOf } from "./clientMessages";
import type { GroomHash } from "./groomHash";
import type { AddCharacter, ClientMessage, ErrorMessage, HairState, PoseSample } from "./messages";
import { ErrorReason } from "./messages";

interface OfferedGroom {
  readonly bytes: Uint8Array;
  ready: boolean;
}

/** The newest of each kind. */
type Settings = Map<string, ClientMessage>;

interface RequestedCharacter {
  /** with its newest level, and the state from which a new server continues its hair */
  added: AddCharacter;
  /** what is resent of each character */
  readonly settings: Settings;
  /** CharacterAdded has come */
  confirmed: boolean;
  /** the newest */
  pose: PoseSample | null;
}

/** What is to be sent over a new connection: offers first, poses last. */
export interface Resend {
  readonly offers: (readonly [GroomHash, Uint8Array])[];
  readonly messages: ClientMessage[];
  readonly poses: PoseSample[];
}

/**
 * The requests of a client, and which of them the server has confirmed, so that all can be sent again over a new
 * connection. No I/O.
 */
export class RequestedState {
  readonly #grooms = new Map<GroomHash, OfferedGroom>();
  readonly #characters = new Map<number, RequestedCharacter>();
  /** removed, and not confirmed */
  readonly #leaving = new Set<number>();
  /** characters that the server may know already; it may announce them before it refuses them */
  readonly #sentTwice = new Set<number>();
  /** what is resent of the session */
  readonly #settings: Settings = new Map();

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

  /** Stores what the message changes: the characters, their levels, and what is resent. */
  store(message: ClientMessage): void {
    switch (message.type) {
      case "addCharacter":
        this.#sentTwice.delete(message.character);
        this.#characters.set(message.character, {
          added: message,
          settings: new Map(),
          confirmed: false,
          pose: null,
        });
        return;
      case "removeCharacter":
        this.#characters.delete(message.character);
        this.#leaving.add(message.character);
        return;
      case "setLevel":
        this.#change(message.character, { level: message.level });
        if (message.level === LevelIndex.rigid) this.forgetState(message.character);
        return;
    }
    // A new server announces the character with the newest.
    if (message.type === "setAppearance")
      this.#change(message.character, { tag: message.tag, appearance: message.appearance });
    const { resent } = codecOf(message);
    if (resent === "session") this.#settings.set(message.type, message);
    else if (resent === "character" && "character" in message)
      this.#characters.get(message.character)?.settings.set(message.type, message);
  }

  /** The newest pose of each character: a new server shows the character before its next one. */
  storePoses(poses: readonly PoseSample[]): void {
    for (const sample of poses) {
      const known = this.#characters.get(sample.character);
      if (known) known.pose = sample;
    }
  }

  /** The hair of a character is to go on from there, should the server have forgotten it. */
  remember(character: number, state: HairState): void {
    this.#change(character, { state });
  }

  forgetState(character: number): void {
    this.#change(character, { state: null });
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

  /** True for an error that only means that the message was sent twice: it had arrived before the connection broke. */
  onError(error: ErrorMessage): boolean {
    if (error.character === 0) return false;
    if (error.reason === ErrorReason.characterUnknown) return this.#leaving.delete(error.character);
    if (error.reason !== ErrorReason.characterExists || !this.#sentTwice.delete(error.character)) return false;
    this.onAdded(error.character);
    return true;
  }

  /** A new connection has its welcome. `resumed`: the server still has what it confirmed. */
  takeResend(resumed: boolean): Resend {
    const resend: Resend = { offers: [], messages: [], poses: [] };
    this.#sentTwice.clear();
    for (const [hash, groom] of this.#grooms) {
      groom.ready &&= resumed;
      if (!groom.ready) resend.offers.push([hash, groom.bytes]);
    }
    if (!resumed) this.#leaving.clear();
    for (const character of this.#leaving) resend.messages.push({ type: "removeCharacter", character });
    for (const character of this.#characters.values()) {
      this.#resendCharacter(character, resumed, resend.messages);
      if (!resumed && character.pose) resend.poses.push(character.pose);
    }
    resend.messages.push(...inOrder(this.#settings));
    return resend;
  }

  #change(character: number, change: Partial<AddCharacter>): void {
    const known = this.#characters.get(character);
    if (known) known.added = { ...known.added, ...change };
  }

  #resendCharacter(known: RequestedCharacter, resumed: boolean, messages: ClientMessage[]): void {
    const { character, level } = known.added;
    known.confirmed &&= resumed;
    if (!known.confirmed) {
      messages.push(known.added);
      if (resumed) this.#sentTwice.add(character);
    }
    // The server may have added it before the connection broke, with an older level.
    if (resumed) messages.push({ type: "setLevel", character, level });
    messages.push(...inOrder(known.settings));
  }
}

/** As the table of messages has them, whatever the order in which they came. */
function inOrder(settings: Settings): ClientMessage[] {
  return Object.keys(clientCodecs).flatMap((type) => settings.get(type) ?? []);
}
