import type { MemberImportance, ReportImportance } from "./messages";
import { kMembersPerMessageMax } from "./messages";

const kIntervalNs = 250_000_000;
/** Relative change of the screen height that is worth a report. */
const kChange = 0.1;

/** That the server takes for a member of which nothing was reported. */
const kUnreportedHeight = 0.25;

interface Reported {
  now: MemberImportance;
  /** null: nothing was */
  sent: MemberImportance | null;
  due: boolean;
  hasLeft: boolean;
}

/** Reports how this client sees members: at most four times a second, relevant changes only. */
export class ImportanceReporter {
  readonly #members = new Map<number, Reported>();
  #anyDue = false;
  #nextNs = 0;

  report(members: readonly MemberImportance[]): void {
    for (const now of members) {
      let reported = this.#members.get(now.member);
      if (!reported) {
        reported = { now, sent: null, due: true, hasLeft: false };
        this.#members.set(now.member, reported);
      }
      reported.now = { member: now.member, screenHeight: now.screenHeight, inView: now.inView };
      reported.hasLeft = false;
      reported.due ||= reported.sent === null || differs(reported.now, reported.sent);
      this.#anyDue ||= reported.due;
    }
  }

  /**
   * The member has left. A report that is on its way may come to the next one with its number: so what the server has
   * of it is undone.
   */
  forget(member: number): void {
    const reported = this.#members.get(member);
    if (!reported?.sent) {
      this.#members.delete(member);
      return;
    }
    reported.now = { member, screenHeight: kUnreportedHeight, inView: true };
    reported.due = reported.hasLeft = this.#anyDue = true;
  }

  forgetAll(): void {
    this.#members.clear();
    this.#anyDue = false;
  }

  /** The server may have missed some. */
  resendAll(): void {
    for (const reported of this.#members.values()) reported.due = true;
    this.#anyDue = this.#members.size > 0;
  }

  /** The report that is due now, if any. */
  take(nowNs: number): ReportImportance | null {
    if (nowNs < this.dueNs) return null;
    const members: MemberImportance[] = [];
    this.#anyDue = false;
    for (const reported of this.#members.values()) {
      if (!reported.due) continue;
      if (members.length === kMembersPerMessageMax) {
        this.#anyDue = true;
        break;
      }
      members.push(reported.now);
      reported.sent = reported.now;
      reported.due = false;
      if (reported.hasLeft) this.#members.delete(reported.now.member);
    }
    this.#nextNs = nowNs + kIntervalNs;
    return members.length > 0 ? { type: "reportImportance", members } : null;
  }

  /** When the next report is due; Infinity when nothing is to be reported. */
  get dueNs(): number {
    return this.#anyDue ? this.#nextNs : Infinity;
  }
}

function differs(a: MemberImportance, b: MemberImportance): boolean {
  const most = Math.max(a.screenHeight, b.screenHeight);
  return a.inView !== b.inView || Math.abs(a.screenHeight - b.screenHeight) > kChange * most;
}
