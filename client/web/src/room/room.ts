import type { Groom } from "../hair/groom";
import type { MemberImportance } from "../hair/hairSource";
import { HairnetError } from "../module/hairnetError";
import { client, startClient } from "../module/client";
import { checkLinkOptions, kLinkOptions, type LinkOptions } from "../net/linkOptions";
import { EventKind, Link, LinkState, type LinkEvent } from "../net/link";
import { webSocketUrl } from "../net/url";
import type { Member } from "./member";
import type { OwnCharacter } from "./ownCharacter";
import { People, type Happened, type RoomState } from "./people";
import {
  checkHands,
  checkNumber,
  handsOf,
  numberBytes,
  placeBytes,
  propBytes,
  propsOf,
  Release,
  sessionBytes,
  TouchAudience,
  withHands,
  type Hand,
  type Prop,
} from "./touch";
import { kWindBytes, windFrom, type Wind } from "./wind";

/** The default of `RoomOptions.errorM`. */
const kErrorM = 0.001;
/** The counters in the order of hairnet_counters, each a 64-bit number after the 8 bytes of `size`. */
const kCounterNames = [
  "bytesSent",
  "bytesReceived",
  "framesReceived",
  "framesDropped",
  "framesUndecodable",
  "posesDropped",
  "inputsDropped",
  "reconnects",
  "resumes",
  "redirects",
  "serversSilent",
  "downloadedBytes",
  "downloadByteCount",
] as const;
const kCountersBytes = 8 + 8 * kCounterNames.length;
/** The size of hairnet_importance: member, screen height, and whether any of it is in view. */
const kImportanceBytes = 12;

/**
 * What has happened since the room was made (`hairnet_counters` of client/hairnet.h). `inputsDropped`: poses, hands,
 * props, winds, materials and appearances of this program that were not finite, or out of range.
 */
export type RoomCounters = { [name in (typeof kCounterNames)[number]]: number };

/** The progress of grooms on their way, and of those that have arrived since none was. */
export interface Downloads {
  readonly bytes: number;
  /** The sum of the sizes of these files, where a size is known. */
  readonly byteCount: number;
}

/** What a moderator does; `hairnet_moderation` of client/hairnet.h. */
export enum ModerateAction {
  remove,
  mute,
  unmute,
  lock,
  unlock,
}

export interface RoomOptions extends LinkOptions {
  /**
   * The approximate error of hair (RMS) that is wanted where a head fills the screen, m; 0.001 by default. Where a head
   * is smaller, the error may be larger in proportion. 0 asks for the smallest error that there is.
   */
  readonly errorM?: number;
}

/**
 * Joins a room. Rejects with a one-line `HairnetError` when the first attempt fails; afterwards the room reconnects by
 * itself whenever the connection breaks.
 */
export async function connect(server: string, options: RoomOptions = {}): Promise<Room> {
  checkLinkOptions(options, { ...kLinkOptions, errorM: kErrorM });
  webSocketUrl(server);
  await startClient();
  const { errorM = kErrorM, ...rest } = options;
  const link = new Link(server, rest, errorM);
  const room = new Room(link);
  await link.connect();
  return room;
}

/**
 * All members of a room, played out smoothly; a `HairSource` for `HairScene`. It fetches grooms of other members by
 * itself. Call `sample` regularly (`HairScene.update` does): it processes the received events.
 */
export class Room extends People {
  /** While true, the room asks the server for no groom but that of the member of `fetchFirst`. */
  fetchesOnlyFirst = false;
  /** The member of `fetchFirst`. */
  #first: number | null = null;
  #state: RoomState = "connected";

  /** @internal */
  constructor(readonly link: Link) {
    super(client(), link.room, "hairnet_", link, () => link.soon());
  }

  get state(): RoomState {
    return this.#state;
  }

  /** This client's session, as others see it in `Member.session`; another after a server has lost it. */
  get session(): bigint {
    return BigInt.asUintN(64, this.module.callWide("hairnet_session", this.handle));
  }

  /** The wind in which the room's hair moves, whoever has set it; still air before the server has announced it. */
  get wind(): Wind {
    return windFrom(this.module.struct(kWindBytes, (at) => this.module.call("hairnet_get_wind", this.handle, at)));
  }

  /** Whether the server let this client set the wind when it joined; a moderator may forbid it later. */
  get maySetWind(): boolean {
    return this.module.call("hairnet_may_set_wind", this.handle) !== 0;
  }

  get counters(): RoomCounters {
    const view = this.module.struct(kCountersBytes, (at) => {
      this.module.view().setUint32(at, kCountersBytes, true);
      this.module.call("hairnet_get_counters", this.handle, at);
    });
    const counters = Object.fromEntries(
      kCounterNames.map((name, i) => [name, Number(view.getBigUint64(8 + 8 * i, true))]),
    ) as RoomCounters;
    counters.inputsDropped += this.dropped.count;
    return counters;
  }

  /** The bytes of other members' grooms that are on their way, and of those that have arrived since none was. */
  get downloads(): Downloads {
    const { downloadedBytes, downloadByteCount } = this.counters;
    return { bytes: downloadedBytes, byteCount: downloadByteCount };
  }

  /** Moves all members to now, by the link's own clock, and calls the listeners of what has happened. */
  sample(_nowMs: number): readonly Member[] {
    this.link.turn();
    this.module.call("hairnet_fetch_first", this.handle, this.#first ?? 0, Number(this.fetchesOnlyFirst));
    this.module.call("hairnet_advance", this.handle);
    const events = this.link.takeEvents();
    const shown = this.show(events.flatMap(happenedIn));
    for (const event of events) this.#take(event);
    this.link.soon();
    return shown;
  }

  /** Asks for this member's groom before all others, as soon as the member is known. Null: no groom comes first. */
  fetchFirst(member: number | null): void {
    this.#first = member;
  }

  /** Tells the server how large each member is on the screen, by which it chooses their detail. */
  reportImportance(members: readonly MemberImportance[]): void {
    const known = members.filter(({ member, screenHeight }) => {
      if (!Number.isFinite(screenHeight)) this.dropped.drop(`the screen height of member ${member} is ${screenHeight}`);
      return this.members.has(member) && Number.isFinite(screenHeight);
    });
    const view = new DataView(new ArrayBuffer(kImportanceBytes * known.length));
    known.forEach(({ member, screenHeight, inView }, i) => {
      view.setUint32(kImportanceBytes * i, member, true);
      view.setFloat32(kImportanceBytes * i + 4, screenHeight, true);
      view.setUint32(kImportanceBytes * i + 8, Number(inView), true);
    });
    this.module.with(new Uint8Array(view.buffer), (at) =>
      this.module.call("hairnet_report_importance", this.handle, at, known.length),
    );
    this.link.soon();
  }

  /**
   * Removes or mutes a person, or locks the room, if this client's token says `moderate`; otherwise a "error" follows.
   * `who` is a character of the person, or the person's subject as the server's log names it ("sub:alice"); "" for
   * `lock` and `unlock`. `seconds` is how long a removed person is banned, and `reason` is for people.
   */
  moderate(action: ModerateAction, who: Member | string = "", seconds = 0, reason = ""): void {
    if (!(action in ModerateAction)) throw new HairnetError("invalid", `moderate: there is no ${String(action)}`);
    if (!(Number.isInteger(seconds) && seconds >= 0 && seconds < 2 ** 32))
      throw new HairnetError("invalid", `moderate: the seconds of a ban are ${seconds}, no whole number from 0`);
    const [member, subject] = typeof who === "string" ? [0, who] : [who.member, ""];
    const texts = [subject, reason].map((text) => this.module.put(new TextEncoder().encode(`${text}\0`)));
    try {
      this.module.check("", "hairnet_moderate", this.handle, action, member, texts[0], seconds, texts[1]);
    } finally {
      for (const at of texts) this.module.call("free", at);
    }
    this.link.soon();
  }

  /**
   * Tells where all hands of this person are now; best called together with the poses. An empty list means that the
   * hands are gone, as they also are half a second after the last call. Hands with numbers out of range are dropped,
   * counted in `counters.inputsDropped` and reported on the console. Throws `HairnetError` for what are no hands.
   */
  pushHands(hands: readonly Hand[]): void {
    const { module, handle } = this;
    checkHands(hands);
    this.#orTell(() =>
      withHands(module, hands, (at) => module.check("pushHands: ", "hairnet_push_hands", handle, at, hands.length)),
    );
  }

  /** The hands of other people near members, by their session, at the time at which hair is shown. */
  get hands(): ReadonlyMap<bigint, readonly Hand[]> {
    return handsOf(this.module, this.handle);
  }

  /**
   * Says who may touch the hair of an own character; at first only its owner may. `chosen`: sessions, which only the
   * audience of chosen people has. After a reconnect as another session nobody is chosen any more, since the numbers
   * may mean other people then.
   */
  setTouch(own: OwnCharacter, audience: TouchAudience, chosen: readonly bigint[] = []): void {
    const { module, handle } = this;
    if (!(audience in TouchAudience)) throw new HairnetError("invalid", `setTouch: there is no ${String(audience)}`);
    module.with(sessionBytes(chosen), (at) =>
      module.check("setTouch: ", "hairnet_set_touch", handle, own.character, audience, at, chosen.length),
    );
    this.link.soon();
  }

  /** Whether this client's hands may touch the member's hair, as far as it knows. */
  mayTouch(member: Member): boolean {
    return this.module.call("hairnet_may_touch", this.handle, member.member) !== 0;
  }

  /**
   * This person's shape of the number `hand` takes hold of the member's hair within `radiusM` (at most 0.3) of `place`,
   * in the shape's own axes: the hand's with y turned the shortest way into the capsule's axis, from its middle. A
   * "held" answers. It holds until `letGo`, the hair is pulled out, the shape is gone, or the connection is lost.
   */
  takeHold(member: Member, hand: number, place: readonly [number, number, number] = [0, 0, 0], radiusM = 0.03): void {
    const { module, handle } = this;
    checkNumber(hand, "takeHold", "the number of the hand");
    module.with(placeBytes(place), (at) =>
      module.check("takeHold: ", "hairnet_take_hold", handle, member.member, hand, at, radiusM),
    );
    this.link.soon();
  }

  /**
   * Lets go of the member's hair that a hand holds, if it holds any; `Release.unpin` ends pins whatever the hand. While
   * the room is not connected, this and `setProps` are dropped as by `pushHands`, and `takeHold` throws.
   */
  letGo(member: Member, hand: number, release = Release.drop): void {
    checkNumber(hand, "letGo", "the number of the hand");
    if (!(release in Release)) throw new HairnetError("invalid", `letGo: there is no release ${String(release)}`);
    this.module.call("hairnet_let_go", this.handle, member.member, hand, release);
    if (this.#state !== "connected") this.dropped.tellOnce("letGo: the room is not connected; it was dropped");
    this.link.soon();
  }

  /**
   * Adds and moves props of the room, and takes away those with the numbers of `removed`. Props stay when this client
   * leaves. The event "props" follows, or "error". If a number is out of range, the whole call is dropped, as by
   * `pushHands`.
   */
  setProps(props: readonly Prop[], removed: readonly number[] = []): void {
    const { module, handle } = this;
    const [set, gone] = [propBytes(props), numberBytes(removed)];
    this.#orTell(() =>
      module.with(set, (at) =>
        module.with(gone, (goneAt) =>
          module.check("setProps: ", "hairnet_set_props", handle, at, props.length, goneAt, removed.length),
        ),
      ),
    );
  }

  /** The room's own shapes, by number. A plane comes back as the box that it is. */
  get props(): ReadonlyMap<number, Prop> {
    return propsOf(this.module, this.handle);
  }

  /** Whether the server let this client set props when it joined. */
  get maySetProps(): boolean {
    return this.module.call("hairnet_may_set_props", this.handle) !== 0;
  }

  /** Says goodbye; the room stays empty afterwards. */
  close(): void {
    if (this.#state === "closed") return;
    this.module.call("hairnet_close", this.handle);
    this.link.turn();
    this.dropAll();
    this.#setState("closed", "", 0, false);
  }

  protected addToModule(groom: Groom, options: number): number {
    return this.module.made("addCharacter: ", "hairnet_add_character", this.handle, groom.handle, options);
  }

  /** Calls the listeners of an event that is not about a member's coming, leaving or change; `show` tells those. */
  #take(event: LinkEvent): void {
    switch (event.kind) {
      case EventKind.state:
        return this.#setState(kStates[event.state], event.text, event.waitS, event.isRefused);
      case EventKind.wind:
        return this.tell("wind", { wind: this.wind, session: event.session });
      case EventKind.error:
        return this.tell("error", { detail: event.text });
      case EventKind.props:
        return this.tell("props", {});
      case EventKind.held:
      case EventKind.touch:
        return this.#takeTouch(event);
      default:
    }
  }

  /**
   * Calls, and does not throw for numbers that are out of range: a single computation may have brought them, and they
   * must not end the program's render loop. They are reported on the console.
   */
  #orTell(call: () => void): void {
    try {
      call();
    } catch (error) {
      if (!(error instanceof HairnetError && error.code === "invalid")) throw error;
      this.dropped.tellOnce(`${error.message}; it was dropped`);
    }
    this.link.soon();
  }

  #takeTouch({ kind, member: number, hand, held }: LinkEvent): void {
    const member = this.members.get(number);
    // The member may have left since the event.
    if (!member) return;
    if (kind === EventKind.held) this.tell("held", { member, hand, pointCount: held });
    else this.tell("touch", { member });
  }

  #setState(state: RoomState, detail: string, waitS: number, isRefused: boolean): void {
    if (this.#state === "closed") return;
    this.#state = state;
    this.tell("state", { state, detail, waitS, isRefused });
  }
}

/**
 * The link's states as a program sees them. A program gets its room after the first connection, so what connects later
 * reconnects.
 */
const kStates: Readonly<Record<LinkState, RoomState>> = {
  [LinkState.connecting]: "reconnecting",
  [LinkState.connected]: "connected",
  [LinkState.reconnecting]: "reconnecting",
  [LinkState.closed]: "closed",
};
/** The events that are about a member. */
const kHappened: Partial<Record<EventKind, Happened["kind"]>> = {
  [EventKind.joined]: "joined",
  [EventKind.left]: "left",
  [EventKind.changed]: "changed",
};

function happenedIn({ kind, member }: LinkEvent): readonly Happened[] {
  const happened = kHappened[kind];
  return happened ? [{ kind: happened, member }] : [];
}
