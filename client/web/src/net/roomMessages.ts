import type { MemberImportance } from "../hair/hairSource";
import { ModerateAction, ObserveMode } from "../generated/enums";
import * as fb from "./generated/messages";
import {
  kMembersPerMessageMax,
  kObserveErrorMaxM,
  kObserveRadiusMaxM,
  kPositionMaxM,
  kScreenHeightMax,
} from "../generated/limits";
import {
  checkInteger,
  checkMember,
  checkMembers,
  checkNumbers,
  enumOf,
  invalid,
  kUtf8,
  membersOf,
  textOf,
  vectorOf,
  type ClientCodec,
} from "./messageCodec";
import { fitText } from "./text";

// What a client says about its room: the wind, what it wants of other members, and moderation.

export type { MemberImportance };

/** Metres, seconds, world axes. */
export interface Wind {
  readonly meanMPerS: readonly [number, number, number];
  readonly gustRatio: number;
  readonly gustPeriodS: number;
  readonly turbulenceRmsMPerS: number;
  readonly turbulenceScaleM: number;
  readonly seed: bigint;
  /** the air goes along with each head, as in a vehicle; else it stands in the room */
  readonly carried: boolean;
}
/** @internal */
export function windOf(w: fb.Wind, carried: boolean): Wind {
  return {
    meanMPerS: [w.meanX(), w.meanY(), w.meanZ()],
    gustRatio: w.gustRatio(),
    gustPeriodS: w.gustPeriodS(),
    turbulenceRmsMPerS: w.turbulenceRmsMPerS(),
    turbulenceScaleM: w.turbulenceScaleM(),
    seed: w.seed(),
    carried,
  };
}

/** @internal Its ranges are the server's. */
export function checkWind({ seed, meanMPerS, carried, ...numbers }: Wind): void {
  if (typeof seed !== "bigint") throw invalid("wind: the seed is no bigint");
  if (typeof carried !== "boolean") throw invalid("wind: carried is not true or false");
  if (meanMPerS.length !== 3) throw invalid("wind: its mean is not 3 numbers");
  checkNumbers([...meanMPerS, ...Object.values(numbers)], "wind");
}

/** The wind of the whole room; the last client to set it wins. */
export interface SetWind {
  readonly type: "setWind";
  readonly wind: Wind;
}
const setWind: ClientCodec<SetWind> = {
  write(to, { wind: w }) {
    const [x, y, z] = w.meanMPerS;
    fb.SetWind.startSetWind(to);
    fb.SetWind.addWind(
      to,
      fb.Wind.createWind(
        to,
        x,
        y,
        z,
        w.gustRatio,
        w.gustPeriodS,
        w.turbulenceRmsMPerS,
        w.turbulenceScaleM,
        BigInt.asUintN(64, w.seed),
      ),
    );
    fb.SetWind.addCarried(to, w.carried);
    return fb.SetWind.endSetWind(to);
  },
  read: (from) => ({ wind: windOf(from.wind()!, from.carried()) }),
  check: ({ wind }) => checkWind(wind),
};

/** Which others of its room a session is sent, and how finely; every frame of all at first. */
export interface Observe {
  readonly type: "observe";
  readonly mode: ObserveMode;
  /** nearest: so many */
  readonly count: number;
  /** radius: heads within it */
  readonly radiusM: number;
  /** what nearest and radius are measured from, world; null: the session's own nearest head */
  readonly from: readonly [number, number, number] | null;
  /** list */
  readonly members: readonly number[];
  /** ticks between frames, at least: 1, 2, 4 */
  readonly stride: number;
  /**
   * About the error of hair, RMS, that is wanted where a head fills the screen, m. Where a head is smaller, the error may
   * be as much larger. 0: the least that there is.
   */
  readonly errorM: number;
  /**
   * How many bytes of frames a second the session wants at most: the server sends coarser hair, then frames at fewer
   * ticks. 0: any number.
   */
  readonly bytesPerS: number;
}
/** Every frame of all members. */
export const kObserveAll: Observe = {
  type: "observe",
  mode: ObserveMode.all,
  count: 0,
  radiusM: 0,
  from: null,
  members: [],
  stride: 1,
  errorM: 0.001,
  bytesPerS: 0,
};
const observe: ClientCodec<Observe> = {
  resent: "session",
  write(to, message) {
    const members = fb.Observe.createMembersVector(to, message.members as number[]);
    fb.Observe.startObserve(to);
    fb.Observe.addMembers(to, members);
    if (message.from) fb.Observe.addFrom(to, fb.Vec3.createVec3(to, ...message.from));
    fb.Observe.addCount(to, message.count);
    fb.Observe.addRadiusM(to, message.radiusM);
    fb.Observe.addStride(to, message.stride);
    fb.Observe.addMode(to, message.mode);
    fb.Observe.addErrorM(to, message.errorM);
    fb.Observe.addBytesPerS(to, message.bytesPerS);
    return fb.Observe.endObserve(to);
  },
  read(from) {
    const origin = from.from();
    return {
      mode: enumOf(from.mode(), ObserveMode.all, ObserveMode.list, "observe mode"),
      count: from.count(),
      radiusM: from.radiusM(),
      from: origin ? vectorOf(origin) : null,
      members: membersOf(from.membersArray(), "observe"),
      stride: from.stride(),
      errorM: Math.fround(from.errorM()), // also the default
      bytesPerS: from.bytesPerS(),
    };
  },
  check({ mode, count, radiusM, from, members, stride, errorM, bytesPerS }) {
    checkInteger(mode, ObserveMode.all, ObserveMode.list, "observe mode");
    checkInteger(count, 0, 0xffffffff, "observed count");
    checkInteger(bytesPerS, 0, 0xffffffff, "observed bytes a second");
    checkMembers(members, "observed members");
    if (![1, 2, 4].includes(stride)) throw invalid("observe: stride is not 1, 2 or 4");
    if (!(radiusM >= 0 && radiusM <= kObserveRadiusMaxM))
      throw invalid(`observe: radius not in [0, ${kObserveRadiusMaxM}] m`);
    if (!(errorM >= 0 && errorM <= kObserveErrorMaxM))
      throw invalid(`observe: errorM not in [0, ${kObserveErrorMaxM}]`);
    const near = (x: number) => Math.abs(x) <= kPositionMaxM;
    if (from && !(from.length === 3 && from.every(near)))
      throw invalid(`observe: the point it is measured from is not finite, or beyond ${kPositionMaxM} m`);
  },
};

function checkScreenHeight(screenHeight: number): void {
  if (!(screenHeight >= 0 && screenHeight <= kScreenHeightMax))
    throw invalid(`importance: screen height not in [0, ${kScreenHeightMax}]`);
}

export interface ReportImportance {
  readonly type: "reportImportance";
  readonly members: readonly MemberImportance[];
}
const reportImportance: ClientCodec<ReportImportance> = {
  write(to, { members }) {
    fb.ReportImportance.startMembersVector(to, members.length);
    for (let i = members.length - 1; i >= 0; --i) {
      const each = members[i];
      fb.MemberImportance.createMemberImportance(to, each.member, each.screenHeight, each.inView);
    }
    return fb.ReportImportance.createReportImportance(to, to.endVector());
  },
  read(from) {
    const count = from.membersLength();
    if (count > kMembersPerMessageMax) throw invalid(`importance: more than ${kMembersPerMessageMax} members`);
    const members: MemberImportance[] = [];
    for (let i = 0; i < count; ++i) {
      const each = from.members(i)!;
      checkScreenHeight(each.screenHeight());
      members.push({ member: each.member(), screenHeight: each.screenHeight(), inView: each.inView() });
    }
    return { members };
  },
  check({ members }) {
    checkInteger(members.length, 0, kMembersPerMessageMax, "members of a report");
    for (const { member, screenHeight } of members) {
      checkMember(member);
      checkScreenHeight(screenHeight);
    }
  },
};

/** What a moderator does in its room. A person is named by `session` or, if that is 0, by `subject`. */
export interface Moderate {
  readonly type: "moderate";
  readonly action: ModerateAction;
  /** the owner of a member, as MemberJoined names it */
  readonly session: bigint;
  /** as the server's log names it: "sub:alice" */
  readonly subject: string;
  /** of the ban after a removal; 0: none */
  readonly seconds: number;
  /** for people and the log */
  readonly reason: string;
}
const moderate: ClientCodec<Moderate> = {
  write(to, { action, session, subject, seconds, reason }) {
    const subjectAt = to.createString(fitText(subject));
    const reasonAt = to.createString(fitText(reason));
    return fb.Moderate.createModerate(to, subjectAt, reasonAt, session, seconds, action);
  },
  read: (from) => ({
    action: enumOf(from.action(), ModerateAction.remove, ModerateAction.unlock, "moderation"),
    session: from.session(),
    subject: textOf(from.subject(kUtf8), "subject"),
    seconds: from.seconds(),
    reason: textOf(from.reason(kUtf8), "reason"),
  }),
  check({ action, seconds }) {
    checkInteger(action, ModerateAction.remove, ModerateAction.unlock, "moderation");
    checkInteger(seconds, 0, 0xffffffff, "seconds of a ban");
  },
};

/** @internal */
export const roomCodecs = { setWind, observe, reportImportance, moderate };
