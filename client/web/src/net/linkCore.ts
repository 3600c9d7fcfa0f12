import type { Frame } from "../hair/frame";
import { HairnetError } from "../hair/hairnetError";
import { LevelIndex } from "../hair/level";
import type { Skin } from "../hair/skin";
import { backoffNs } from "./backoff";
import { BulkScheduler } from "./bulkScheduler";
import { ClockEstimate } from "./clockEstimate";
import { validatePoseSample } from "./characterMessages";
import { kMessageMax, validateMessage } from "./clientMessages";
import { EventQueue } from "./eventQueue";
import type { FrameSink, GroomFetched, LinkEvent } from "./events";
import { isFinal } from "./finalGoodbye";
import { decodeFrameDatagram, isFrameDatagram, kFrameDatagramLayout } from "./frameDatagram";
import { type Downloads, GroomFetch } from "./groomFetch";
import type { GroomHash } from "./groomHash";
import { hashBytes, hashGroom } from "./groomHash";
import { ImportanceReporter } from "./importanceReporter";
import { LastKnownHair } from "./lastKnownHair";
import type { LinkCounters, LinkCoreOptions } from "./linkCoreOptions";
import { kDefaultOptions } from "./linkCoreOptions";
import { type DecodedFrame, Members } from "./members";
import type * as m from "./messages";
import { ErrorReason, GoodbyeReason, GroomState, kMembersPerMessageMax, kProtocolVersion } from "./messages";
import { decodePacket, encodePacket } from "./packet";
import { RequestedState } from "./requestedState";
import { RequestedWind } from "./requestedWind";
import { SendQueue } from "./sendQueue";
import { SentPoses } from "./sentPoses";
import { kSignOfLifeNs, kSilenceS, Silence } from "./silence";
import { UploadQueue } from "./uploadQueue";

// A pose waits for at most one chunk of a groom: it is kept small.
const kChunkBytes = 16 << 10;
// With those before them they fit kDatagramBytesMax.
const kPosesPerDatagram = 3;
// So many at once are a crowd's: as datagrams they would be too many, and travel in order.
const kPosesInDatagramsMax = 32;
const kAskAgainNs = 1e9;
// Of a pose that was captured before the connection. The server refuses poses of more than a second.
const kPoseAgeMaxNs = 500_000_000;
const kGoodbyeWaitNs = 400_000_000;
// A session that lasted this long counts as successful: the backoff starts again at its shortest wait.
const kStableNs = 5_000_000_000;
// After a resume the server announces all members at once. A member that it has not announced by then has left.
const kMembersResendWaitNs = 1_000_000_000;
// Servers that send a client on and on contradict each other.
const kRedirectsMax = 4;
// A client that was sent on before its first welcome asks for so long: until a dead server's lease has ended, and more.
const kRoomPatienceNs = 30_000_000_000;

type State = "idle" | "waiting" | "wanting" | "opening" | "greeting" | "active" | "leaving" | "ended";

/**
 * A client's whole conversation with a server, without socket and clock: packets and times in, packets and events out.
 * Its owner calls it as follows, with times (ns) of one monotonic clock that never go back:
 *
 *   start()                     once; then after whatever happens:
 *   poll(now)                   time-outs; due again at nextDeadlineNs at the latest
 *   wantsConnection             open one: onOpening(), then onOpen() or onClosed()
 *   takePacket(now)             while it gives packets and the connection takes them: send them
 *   wantsClose                  close: onClosed()
 *
 * What arrives goes into onPacket(), the end of the connection into onClosed().
 *
 * When the connection breaks it asks for a new one after a wait, and then sends the caller's requests again. The
 * caller may call in every state: requests that cannot be sent now are sent later; poses are dropped. Calls
 * throw `HairnetError` for arguments that no server takes, and then change nothing.
 */
export class LinkCore {
  readonly #options: LinkCoreOptions;
  #state: State = "idle";
  /** from onOpening() to onClosed() */
  #connection = false;
  #hasDatagrams = false;
  #goodbyeTaken = false;
  #takenMayBeLost = false;
  /** of the state */
  #deadlineNs = Infinity;
  /** while reconnecting */
  #giveUpNs = Infinity;
  /** the server has announced all of them again after a resume */
  #membersDueNs = Infinity;
  /** for bases that frames wait for */
  #askAgainNs = 0;
  #activeSinceNs = 0;
  /** since when it is, or was last, without a connection that lasts */
  #awaySinceNs: number | null = null;
  /** when a packet, or a sign of life, went out last */
  #sentNs = 0;
  #clock = new ClockEstimate();
  readonly #silence = new Silence();
  readonly #requested = new RequestedState();
  readonly #wind = new RequestedWind();
  readonly #uploads = new UploadQueue(kChunkBytes);
  readonly #uploadScheduler = new BulkScheduler(kChunkBytes);
  readonly #queue = new SendQueue();
  /** over this connection, if it has datagrams */
  readonly #sentPoses = new SentPoses();
  readonly #members = new Members();
  readonly #lastKnown = new LastKnownHair();
  readonly #importance = new ImportanceReporter();
  readonly #fetch = new GroomFetch();
  readonly #events = new EventQueue();
  readonly #counters = {
    bytesSent: 0,
    bytesReceived: 0,
    frameBytesReceived: 0,
    framesReceived: 0,
    framesUndecodable: 0,
    framesUnknown: 0,
    framesEvaluated: 0,
    framesLackingLearnt: 0,
    reconnects: 0,
    resumes: 0,
    redirects: 0,
    redirectLoops: 0,
    serversSilent: 0,
  };
  #sink: FrameSink | null = null;
  #welcome: m.Welcome | null = null;
  /** null, here and below: the server that the caller knows */
  #redirectedTo: m.ServerAt | null = null;
  #welcomedAt: m.ServerAt | null = null;
  /** attempts since the one at the last server failed */
  #asked = 0;
  /** in a row, since the last welcome */
  #redirects = 0;
  /** time of the first redirect since the last welcome */
  #sentOnNs: number | null = null;
  /** " at" the address of the server that was asked last, or "" */
  #where = "";
  #endDetail = "";
  #endReason = GoodbyeReason.none;

  constructor(options: Partial<LinkCoreOptions> = {}) {
    const given = Object.entries(options).filter(([, value]) => value !== undefined);
    this.#options = { ...kDefaultOptions, ...Object.fromEntries(given) };
    validateMessage(this.#hello());
  }

  // The caller's side.

  start(): void {
    if (this.#state === "idle") this.#state = "wanting";
  }

  /** `bytes` is a groom's file; kept for as long as it may have to be sent again. */
  offerGroom(bytes: Uint8Array): GroomHash {
    const hash = hashGroom(bytes);
    validateMessage({ type: "groomOffer", hash, byteCount: bytes.length });
    this.#requested.offer(hash, bytes);
    const offer = this.isActive ? this.#uploads.offer(hash, bytes) : null;
    if (offer) this.#enqueue(offer);
    return hash;
  }

  /**
   * Any request but those with a call of their own below; kept, not copied. What must outlive the connection is also
   * stored: characters, levels, and the newest of every message whose codec says `resent`.
   */
  send(message: m.ClientMessage): void {
    validateMessage(message);
    const hidesHair = message.type === "setLevel" && message.level === LevelIndex.rigid;
    if (hidesHair || message.type === "removeCharacter") this.#lastKnown.drop(message.character);
    if (message.type === "setWind") this.#wind.set(message);
    this.#requested.store(message);
    this.#enqueue(message);
  }

  /** Poses of one moment, sent as one batch; copied. */
  pushPoses(poses: readonly m.PoseSample[]): void {
    poses.forEach(validatePoseSample);
    const copied = poses.map((sample) => ({ ...sample, pose: sample.pose.slice() }));
    this.#requested.storePoses(copied);
    const asDatagrams = this.#hasDatagrams && copied.length <= kPosesInDatagramsMax;
    if (this.isActive) this.#queue.pushPoses(copied, asDatagrams ? kPosesPerDatagram : undefined);
    else this.#queue.dropPoses(copied);
  }

  /** Said a few times a second at most, and what has changed enough to matter. */
  reportImportance(members: readonly m.MemberImportance[]): void {
    for (let begin = 0; begin < members.length; begin += kMembersPerMessageMax)
      validateMessage({ type: "reportImportance", members: members.slice(begin, begin + kMembersPerMessageMax) });
    this.#importance.report(members);
  }

  /** Another's groom: `GroomFetched` follows, or an error message (groomUnavailable). */
  requestGroom(hash: GroomHash): void {
    hashBytes(hash);
    const request = this.#fetch.request(hash);
    if (request) this.#enqueue(request);
  }

  /** The skin to keep the groom's hair out of; null until frames of coefficients have brought the groom's basis. */
  skinOf(groom: GroomHash): Skin | null {
    return this.#members.bases.of(groom)?.skin ?? null;
  }

  /** of other members' grooms */
  get downloads(): Downloads {
    return this.#fetch.downloads;
  }

  /** Frames then go there, and no `FrameBatch` events come; null: events again. */
  setFrameSink(sink: FrameSink | null): void {
    this.#sink = sink;
  }

  /**
   * Bases and learnt hair are then downloaded of the grooms only for which `isOfUse` returns true: hair that cannot be
   * drawn yet needs none.
   */
  downloadHairOf(isOfUse: (groom: GroomHash) => boolean): void {
    this.#members.isOfUse = isOfUse;
  }

  /** Says goodbye; `hasEnded` follows. */
  leave(nowNs: number): void {
    if (this.#state === "leaving" || this.hasEnded) return;
    const goodbye: m.Goodbye = { type: "goodbye", reason: GoodbyeReason.clientLeaves, detail: "" };
    if (!this.isActive || !this.#queue.push(goodbye)) return this.#end(GoodbyeReason.clientLeaves, kClosedHere);
    this.#state = "leaving";
    this.#deadlineNs = nowNs + kGoodbyeWaitNs;
  }

  takeEvents(): LinkEvent[] {
    return this.#events.takeAll();
  }

  get isActive(): boolean {
    return this.#state === "active";
  }
  get hasEnded(): boolean {
    return this.#state === "ended";
  }
  /** Once `hasEnded`: one line of why. */
  get endDetail(): string {
    return this.#endDetail;
  }
  /** Once `hasEnded`. */
  get endReason(): GoodbyeReason {
    return this.#endReason;
  }
  /** The last one. */
  get welcome(): m.Welcome | null {
    return this.#welcome;
  }
  /** A time on the server's clock, on ours; as it is while no server's clock is known. */
  toLocalNs(serverTimeNs: number): number {
    return this.#clock.toLocal(serverTimeNs);
  }
  get counters(): LinkCounters {
    return {
      ...this.#counters,
      framesDropped: this.#events.framesDropped,
      posesDropped: this.#queue.posesDropped,
    };
  }

  // The connection's side.

  poll(nowNs: number): void {
    if (this.hasEnded) return;
    if (nowNs >= this.#giveUpNs) return this.#end(GoodbyeReason.none, "gave up reconnecting");
    if (this.isActive) this.#pollActive(nowNs);
    if (nowNs < this.#deadlineNs) return;
    switch (this.#state) {
      case "waiting":
        this.#state = "wanting";
        this.#deadlineNs = Infinity;
        break;
      case "opening":
      case "greeting":
        this.#lose(
          GoodbyeReason.none,
          `no welcome from the server${this.#where} within ${this.#options.connectTimeoutS} s`,
          nowNs,
          true,
        );
        break;
      case "leaving":
        this.#end(GoodbyeReason.clientLeaves, kClosedHere);
        break;
      default:
        break;
    }
  }

  get nextDeadlineNs(): number {
    if (this.hasEnded) return Infinity;
    const leastNs = Math.min(this.#deadlineNs, this.#giveUpNs);
    if (!this.isActive) return leastNs;
    const keepAliveNs = this.#sentNs + kSignOfLifeNs;
    const silenceNs = this.#welcome!.signsOfLife ? this.#silence.nextLookNs : Infinity;
    return Math.min(leastNs, this.#membersDueNs, this.#importance.dueNs, keepAliveNs, silenceNs);
  }

  get wantsConnection(): boolean {
    return this.#state === "wanting" && !this.#connection;
  }

  /** Where to: a server that another one has named; null: the one that the caller knows. */
  get redirectedTo(): m.ServerAt | null {
    return this.#redirectedTo;
  }

  get wantsClose(): boolean {
    const done = this.hasEnded || this.#state === "waiting" || this.#state === "wanting";
    return this.#connection && (done || (this.#state === "leaving" && this.#goodbyeTaken));
  }

  /**
   * Gives up a connection that works: `wantsClose`, then at once `wantsConnection` for a better one, over which the
   * session goes on. False, and nothing happens, without a session or where the options say not to reconnect.
   */
  replaceConnection(why: string, nowNs: number): boolean {
    if (!this.isActive || !this.#options.reconnect) return false;
    this.#goOnElsewhere(why, nowNs);
    return !this.hasEnded;
  }

  /** `where`: the server's address, for people; "": its owner does not say. */
  onOpening(nowNs: number, where = ""): void {
    if (!this.wantsConnection) return;
    this.#where = where === "" ? "" : ` at ${where}`;
    this.#connection = true;
    this.#state = "opening";
    this.#deadlineNs = nowNs + 1e9 * this.#options.connectTimeoutS;
  }

  /** `hasDatagrams`: packets that may be lost travel as such. */
  onOpen(hasDatagrams = false): void {
    if (this.#state !== "opening") return;
    this.#state = "greeting";
    this.#hasDatagrams = hasDatagrams;
    this.#sentPoses.clear();
    this.#queue.clear();
    this.#queue.push(this.#hello());
  }

  /** `detail`: one line that says why it could not be opened or how it ended. */
  onClosed(detail: string, nowNs: number): void {
    if (!this.#connection) return;
    this.#connection = false;
    if (this.#state === "leaving") return this.#end(GoodbyeReason.clientLeaves, kClosedHere);
    if (this.#state === "opening" || this.#state === "greeting" || this.isActive)
      this.#lose(GoodbyeReason.none, detail, nowNs, !this.isActive);
  }

  /** The next packet to send, stamped with the time; null when there is none. */
  takePacket(nowNs: number): Uint8Array | null {
    if (!this.#connection || this.#goodbyeTaken) return null;
    if (this.#state !== "greeting" && !this.isActive && this.#state !== "leaving") return null;
    const isChunk = this.isActive && this.#uploads.isWaiting && (this.#queue.isEmpty || this.#uploadScheduler.isDue);
    let message = isChunk ? this.#uploads.nextChunk() : this.#queue.pop();
    if (!message) return null;
    this.#goodbyeTaken = message.type === "goodbye";
    this.#takenMayBeLost = mayBeLost(message);
    const mayRepeat = this.#takenMayBeLost && this.#hasDatagrams;
    if (mayRepeat && message.type === "poseBatch" && message.poses.length <= kPosesPerDatagram)
      message = this.#sentPoses.repeatIn(message);
    if (message.type === "removeCharacter") this.#sentPoses.forget(message.character);
    this.#sentNs = nowNs;
    const packet = encodePacket(nowNs, message);
    if (isChunk) this.#uploadScheduler.sentBulk();
    else this.#uploadScheduler.sentSoon(packet.length, this.#uploads.isWaiting);
    this.#counters.bytesSent += packet.length;
    return packet;
  }

  /** Whether newer packets replace the last one taken: it may travel where packets get lost or overtake others. */
  get takenMayBeLost(): boolean {
    return this.#takenMayBeLost;
  }

  /** Takes exactly one packet, size prefix included, or a frame datagram. A malformed packet ends the connection; nothing is thrown. */
  onPacket(packet: Uint8Array, nowNs: number): void {
    if (this.#state !== "greeting" && !this.isActive) return;
    this.#silence.onHeard(nowNs);
    this.#counters.bytesReceived += packet.length;
    let envelope: m.Envelope;
    try {
      envelope = isFrameDatagram(packet) ? decodeFrameDatagram(packet) : decodePacket(packet);
    } catch (error) {
      if (!(error instanceof HairnetError)) throw error;
      return this.#lose(GoodbyeReason.protocolError, `the server sent a bad packet: ${error.message}`, nowNs);
    }
    const { message, clockNs } = envelope;
    if (this.#state === "greeting" && message.type === "frameBatch" && message.generations.length > 0) {
      this.#counters.framesUnknown += message.frames.length; // a datagram that has overtaken the welcome
      return;
    }
    // A new session may be of another server, whose clock is another.
    if (message.type === "welcome" && !message.resumed) this.#clock = new ClockEstimate();
    this.#clock.observe(clockNs, nowNs);
    if (message.type === "frameBatch") this.#counters.frameBytesReceived += packet.length;
    if (this.#state === "greeting" && !kMayComeFirst.has(message.type))
      return this.#lose(GoodbyeReason.protocolError, "the server sent another message before its welcome", nowNs);
    this.#take(message, nowNs);
  }

  #take(message: m.Message, nowNs: number): void {
    switch (message.type) {
      case "welcome":
        return this.#onWelcome(message, nowNs);
      case "groomNeed":
        this.#uploads.need(message); // a groom that was dropped meanwhile is no longer known
        return;
      case "groomStatus":
        return this.#onGroomStatus(message);
      case "characterAdded":
        return this.#onCharacterAdded(message, nowNs);
      case "characterRemoved":
        this.#requested.onRemoved(message.character);
        this.#members.removeOwn(message.character);
        return this.#push(message);
      case "memberJoined":
        return this.#onMemberJoined(message);
      case "memberChanged":
        if (this.#members.change(message)) this.#push(message);
        return;
      case "roomWind":
        return this.#onRoomWind(message);
      case "memberLeft":
        this.#importance.forget(message.member);
        if (this.#members.leave(message.member)) this.#push(message);
        return;
      case "groomBasis":
        return this.#members.bases.announce(message.groom, message.basis);
      case "groomLearnt":
        if (this.#options.evaluateLearnt) this.#members.announceLearnt(message);
        return;
      case "groomData": {
        const fetched = this.#fetch.take(message);
        return fetched ? this.#onFetched(fetched, nowNs) : undefined;
      }
      case "frameBatch":
        return this.#onFrameBatch(message, nowNs);
      case "redirect":
        return this.#onRedirect(message, nowNs);
      case "error":
        return this.#onError(message);
      case "goodbye":
        if (this.isActive && message.reason === GoodbyeReason.serverDraining) this.#wind.onSentOn();
        return this.#lose(message.reason, `the server says goodbye: ${message.detail}`, nowNs);
      default:
        return this.#lose(GoodbyeReason.protocolError, "the server sent a message that only clients send", nowNs);
    }
  }

  #onFetched(fetched: GroomFetched, nowNs: number): void {
    const { bases, learnt } = this.#members;
    const learntGrooms = learnt.groomsOf(fetched.hash);
    if (learntGrooms.length > 0) return this.#onUnusable(learntGrooms[0], "learnt hair", learnt.take(fetched));
    const grooms = bases.groomsOf(fetched.hash);
    if (grooms.length === 0) return this.#push(fetched);
    const fault = bases.take(fetched);
    if (fault === "") for (const each of grooms) this.#onWaiting(each, nowNs);
    this.#onUnusable(grooms[0], "basis", fault);
  }

  #onUnusable(groom: GroomHash, what: string, fault: string): void {
    if (fault === "") return;
    const detail = `its ${what} cannot be used: ${fault}`;
    this.#push({ type: "error", reason: ErrorReason.groomInvalid, character: 0, groom, detail });
  }

  #hello(): m.Hello {
    const { clientName, room, token, role, trace } = this.#options;
    const welcome = isSameServer(this.#welcomedAt, this.#redirectedTo) ? this.#welcome : null;
    return {
      type: "hello",
      protocolVersion: kProtocolVersion,
      clientName,
      room,
      token,
      role,
      session: welcome ? welcome.session : 0n,
      secret: welcome ? welcome.secret : new Uint8Array(16),
      messageMax: kMessageMax,
      redirects: this.#redirects,
      datagramLayout: kFrameDatagramLayout,
      trace,
      signsOfLife: true,
    };
  }

  #pollActive(nowNs: number): void {
    if (this.#silence.look(nowNs) && this.#welcome!.signsOfLife) {
      ++this.#counters.serversSilent;
      return this.#lose(
        GoodbyeReason.none,
        `the server${this.#where} is silent: nothing came from it for ${kSilenceS} s`,
        nowNs,
      );
    }
    if (nowNs - this.#sentNs >= kSignOfLifeNs) {
      if (this.#queue.isEmpty) this.#enqueue({ type: "poseBatch", poses: [] }); // a keep-alive
      this.#sentNs = nowNs;
    }
    const report = this.#importance.take(nowNs);
    if (report) this.#enqueue(report);
    if (nowNs >= this.#askAgainNs) {
      this.#askAgainNs = nowNs + kAskAgainNs;
      for (const file of this.#members.wantedAgain(nowNs)) this.requestGroom(file);
    }
    if (nowNs < this.#membersDueNs) return;
    this.#membersDueNs = Infinity;
    this.#tellLeft(this.#members.dropUnconfirmed());
  }

  /** Without a session the message is not sent: `RequestedState` stores it and resends it after the next welcome. */
  #enqueue(message: m.ClientMessage): void {
    if (this.isActive && !this.#queue.push(message))
      this.#end(GoodbyeReason.none, "more messages wait to be sent than the server takes");
  }

  #push(event: LinkEvent): void {
    if (!this.#events.push(event)) this.#end(GoodbyeReason.none, "this client does not poll its events");
  }

  #lose(reason: GoodbyeReason, detail: string, nowNs: number, isUnanswered = false): void {
    const wasActive = this.isActive;
    const isPatient = this.#sentOnNs !== null && nowNs - this.#sentOnNs < kRoomPatienceNs;
    const mayTryAgain = this.#welcome ? this.#options.reconnect : isPatient;
    const isRefused = isFinal(reason) || (!this.#welcome && reason === GoodbyeReason.roomRefused);
    if (!mayTryAgain || isRefused) return this.#end(reason, detail);
    this.#putDown(nowNs);
    if (!wasActive) this.#redirectedTo = this.#nextToAsk();
    this.#redirects = Math.min(this.#redirects, 1);
    this.#state = "waiting";
    const sinceNs = this.#awaySinceNs ?? this.#sentOnNs ?? nowNs;
    // A server that does not answer costs no wait while there are others to ask.
    const asksOn = isUnanswered && this.#redirectedTo !== null;
    const waitNs = asksOn ? 0 : backoffNs(nowNs - sinceNs, this.#options.random);
    this.#deadlineNs = nowNs + waitNs;
    if (this.#welcome) this.#push({ type: "reconnecting", reason, detail, waitS: 1e-9 * waitNs });
  }

  /** Once the last server does not answer: the caller's, then those that it has named, and so on. */
  #nextToAsk(): m.ServerAt | null {
    const others = this.#welcome?.others ?? [];
    const turn = this.#asked++ % (others.length + 1);
    return turn === 0 ? null : others[turn - 1];
  }

  /** What belongs to the connection; keeps the hair of the caller's characters. */
  #putDown(nowNs: number): void {
    if (this.isActive) {
      if (this.#awaySinceNs === null || nowNs - this.#activeSinceNs >= kStableNs) this.#awaySinceNs = nowNs;
      const { giveUpAfterS } = this.#options;
      this.#giveUpNs = giveUpAfterS > 0 ? nowNs + 1e9 * giveUpAfterS : Infinity;
    }
    this.#lastKnown.onLost();
    for (const character of this.#requested.characters) {
      const hair = this.#members.hairOf(character);
      if (!hair) continue;
      this.#requested.remember(character, hair.state);
      this.#lastKnown.keep(character, hair);
    }
    this.#members.forgetFrames();
    this.#membersDueNs = Infinity;
    this.#queue.clear();
    this.#uploads.clear();
  }

  #onRedirect(redirect: m.Redirect, nowNs: number): void {
    if (this.isActive) this.#wind.onSentOn();
    const { to } = redirect;
    this.#sentOnNs ??= nowNs;
    if (!to || this.#redirects === kRedirectsMax) {
      if (to) ++this.#counters.redirectLoops;
      this.#redirects = 0;
      const what = !to
        ? "the server does not hold the room any more"
        : "the servers do not agree on who holds the room";
      this.#lose(GoodbyeReason.none, what, nowNs);
      this.#redirectedTo = null;
      return;
    }
    ++this.#redirects;
    ++this.#counters.redirects;
    this.#goOnElsewhere(`the room is held by ${to.host}, port ${to.port}`, nowNs);
    this.#redirectedTo = to;
  }

  #goOnElsewhere(detail: string, nowNs: number): void {
    this.#putDown(nowNs);
    if (this.#welcome) this.#push({ type: "reconnecting", reason: GoodbyeReason.none, detail, waitS: 0 });
    if (this.hasEnded) return;
    this.#state = "wanting";
    this.#deadlineNs = Infinity;
  }

  #end(reason: GoodbyeReason, detail: string): void {
    if (this.hasEnded) return;
    this.#state = "ended";
    this.#queue.clear();
    this.#uploads.clear();
    this.#endDetail = detail;
    this.#endReason = reason;
    this.#events.pushLast({ type: "disconnected", reason, detail });
  }

  #onWelcome(welcome: m.Welcome, nowNs: number): void {
    if (this.#state !== "greeting")
      return this.#lose(GoodbyeReason.protocolError, "the server sent a second welcome", nowNs);
    const again = this.#welcome !== null;
    const resumed = again && welcome.resumed;
    this.#state = "active";
    this.#deadlineNs = this.#giveUpNs = Infinity;
    this.#activeSinceNs = nowNs;
    this.#welcome = welcome;
    this.#welcomedAt = this.#redirectedTo;
    this.#redirects = 0;
    this.#sentOnNs = null;
    this.#asked = 0;
    if (again) ++this.#counters.reconnects;
    if (resumed) ++this.#counters.resumes;
    this.#push({ type: "connected", welcome, again });
    if (resumed) {
      this.#members.markAllUnconfirmed();
      this.#membersDueNs = nowNs + kMembersResendWaitNs;
    } else {
      this.#tellLeft(this.#members.dropAll());
      const { bases, learnt } = this.#members;
      for (const file of [...bases.clear(), ...learnt.clear()]) this.#fetch.refuse(file);
    }
    this.#resendAll(resumed, nowNs);
    const wind = this.#wind.onWelcome(welcome.maySetWind || !again);
    if (wind) this.#enqueue(wind);
  }

  #onRoomWind(told: m.RoomWind): void {
    this.#push(told);
    const ours = this.#wind.onTold(told, this.#welcome!.session);
    if (ours) this.#enqueue(ours);
  }

  #resendAll(resumed: boolean, nowNs: number): void {
    const resend = this.#requested.takeResend(resumed);
    for (const [hash, bytes] of resend.offers) {
      const offer = this.#uploads.offer(hash, bytes);
      if (offer) this.#enqueue(offer);
    }
    for (const message of resend.messages) this.#enqueue(message);
    for (const request of this.#fetch.requestAgain()) this.#enqueue(request);
    this.#queue.pushPoses(resend.poses.filter((pose) => nowNs - pose.captureTimeNs <= kPoseAgeMaxNs));
    if (resumed) this.#importance.resendAll();
    else this.#importance.forgetAll();
  }

  #tellLeft(members: readonly number[]): void {
    for (const member of members) {
      this.#importance.forget(member);
      this.#push({ type: "memberLeft", member });
    }
  }

  #onGroomStatus(status: m.GroomStatus): void {
    const { hash, state } = status;
    // Until then its bytes may be another client's, which leaves, or whose bytes prove wrong when they are built.
    if (state === GroomState.ready || state === GroomState.refused) this.#uploads.drop(hash);
    if (state === GroomState.ready) {
      this.#requested.onReady(hash);
      this.#lastKnown.onReady(hash);
    } else if (state === GroomState.refused) {
      this.#requested.onRefused(hash);
      this.#lastKnown.dropOf(hash);
    }
    this.#push(status);
  }

  #onCharacterAdded(added: m.CharacterAdded, nowNs: number): void {
    if (!this.#requested.hasAskedFor(added.character))
      return this.#lose(GoodbyeReason.protocolError, "the server added a character nobody requested", nowNs);
    this.#requested.onAdded(added.character);
    if (this.#members.addOwn(added)) this.#push(added);
  }

  #onMemberJoined(joined: m.MemberJoined): void {
    const former = this.#members.dropPreviousNumber(joined.session, joined.character, joined.member);
    if (former !== null) this.#tellLeft([former]);
    const what = this.#members.join(joined);
    const { member, tag, appearance } = joined;
    if (what === "new") this.#push(joined);
    else if (what === "changed") this.#push({ type: "memberChanged", member, tag, appearance }); // during the outage
  }

  #onFrameBatch({ tick, sampleTimeNs, frames, generations }: m.CodedFrameBatch, nowNs: number): void {
    const events: Frame[] = [];
    for (const [i, coded] of frames.entries()) {
      const generation = generations.length > 0 ? generations[i] : null;
      const decoded = this.#members.decodeMemberFrame(coded, generation, tick, sampleTimeNs, nowNs);
      ++this.#counters.framesReceived;
      if (decoded.outcome === "unknown") ++this.#counters.framesUnknown;
      if (decoded.outcome === "undecodable") ++this.#counters.framesUndecodable;
      if (decoded.lacksLearnt) ++this.#counters.framesLackingLearnt;
      else if (coded.evaluated && decoded.basis) ++this.#counters.framesEvaluated;
      if (decoded.wantsBasis) this.requestGroom(decoded.wantsBasis);
      if (decoded.wantsLearnt) this.requestGroom(decoded.wantsLearnt);
      if (decoded.evaluates) this.#enqueue(decoded.evaluates);
      const frame = this.#frameOf(coded, decoded, false, nowNs);
      if (!frame) continue;
      if (this.#sink) this.#sink(frame, sampleTimeNs, tick);
      else events.push(frame);
    }
    if (events.length > 0) this.#push({ type: "frameBatch", tick, sampleTimeNs, frames: events });
  }

  #onWaiting(groom: GroomHash, nowNs: number): void {
    for (const { coded, tick, timeNs: sampleTimeNs, decoded } of this.#members.decodeWaiting(groom)) {
      if (decoded.outcome === "undecodable") ++this.#counters.framesUndecodable;
      const frame = this.#frameOf(coded, decoded, true, nowNs);
      if (!frame) continue;
      if (this.#sink) this.#sink(frame, sampleTimeNs, tick);
      else this.#push({ type: "frameBatch", tick, sampleTimeNs, frames: [frame] });
    }
  }

  #frameOf(coded: m.CodedFrame, decoded: DecodedFrame, repeated: boolean, nowNs: number): Frame | null {
    const { character, discontinuous, pose, coefficients, basis } = decoded;
    if (!pose) return null;
    // The server simulates it, or has always had it.
    if (character !== 0 && (basis || this.#welcome!.resumed)) this.#lastKnown.drop(character);
    if (character !== 0 && basis) this.#requested.forgetState(character);
    const { member, level, asleep, stepStride } = coded;
    const hair = character !== 0 && !basis ? this.#lastKnown.of(character, level, nowNs) : null;
    return {
      member,
      character,
      level,
      discontinuous,
      asleep,
      repeated,
      stepStride,
      stepS: stepStride / this.#welcome!.tickRateHz,
      pose,
      lastKnown: hair !== null,
      coefficients: hair ? hair.coefficients : coefficients,
      basis: hair ? hair.basis : basis,
    };
  }

  #onError(error: m.ErrorMessage): void {
    const { reason, groom, character } = error;
    const mayBeFetch = reason === ErrorReason.groomUnavailable || reason === ErrorReason.limitExceeded;
    const endsFetch = mayBeFetch && groom !== null && this.#fetch.refuse(groom);
    const { bases, learnt } = this.#members;
    const isMade = groom !== null && bases.groomsOf(groom).length + learnt.groomsOf(groom).length > 0;
    if (mayBeFetch && isMade) return; // frames that need it ask for it again
    if (!endsFetch && groom !== null && endsUpload(error)) {
      this.#uploads.drop(groom);
      this.#requested.onRefused(groom);
    }
    if (!this.#requested.onError(error)) return this.#push(error);
    if (reason !== ErrorReason.characterUnknown) return;
    // The removal was sent twice, and the first answer was lost with a connection. The member may have left already, as
    // one that was not announced after a resume.
    this.#members.removeOwn(character);
    this.#push({ type: "characterRemoved", character });
  }
}

const kClosedHere = "closed by this client";
const kMayComeFirst: ReadonlySet<m.Message["type"]> = new Set(["welcome", "redirect", "error", "goodbye"]);

function isSameServer(a: m.ServerAt | null, b: m.ServerAt | null): boolean {
  return a?.host === b?.host && a?.port === b?.port;
}

/** Poses, but for those that mark a jump, and for an empty batch, which is a sign of life. */
function mayBeLost(message: m.ClientMessage): boolean {
  return message.type === "poseBatch" && message.poses.length > 0 && message.poses.every((pose) => !pose.teleport);
}

/** A refusal of a whole groom; a chunk alone may have come where none was asked for. */
function endsUpload(error: m.ErrorMessage): boolean {
  const { reason, character } = error;
  return reason !== ErrorReason.groomUnavailable && reason !== ErrorReason.unexpectedMessage && character === 0;
}
