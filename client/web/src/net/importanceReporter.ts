import type { MemberImportance, ReportImportance } from "./messages";
import { kMembersPerMessageMax } from "./messages";

const kIntervalNs = 250_000_000;
/** Relative change of the screen height that is worth a report. */
const kChange = 0.1;

interface Reported {
  now: MemberImportance;
  said: MemberImportance;
  due: boolean;
}

/** How this client sees members, said to the server a few times a second at most, and only what has changed enough. */
export class ImportanceReporter {
  readonly #members = new Map<number, Reported>();
  #anyDue = false;
  #nextNs = 0;

  report(members: readonly MemberImportance[]): void {
    for (const now of members) {
      let reported = this.#members.get(now.member);
      if (!reported) {
        reported = { now, said: now, due: true };
        this.#members.set(now.member, reported);
      }
      reported.now = { member: now.member, screenHeight: now.screenHeight, inView: now.inView };
      reported.due ||= differs(reported.now, reported.said);
      this.#anyDue ||= reported.due;
    }
  }

  forget(member: number): void {
    this.#members.delete(member);
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

  /** What is to be said now, if anything. */
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
      reported.said = reported.now;
      reported.due = false;
    }
    this.#nextNs = nowNs + kIntervalNs;
    return members.length > 0 ? { type: "reportImportance", members } : null;
  }

  /** When something may be said; Infinity when there is nothing. */
  get dueNs(): number {
    return this.#anyDue ? this.#nextNs : Infinity;
  }
}

function differs(a: MemberImportance, b: MemberImportance): boolean {
  const most = Math.max(a.screenHeight, b.screenHeight);
  return a.inView !== b.inView || Math.abs(a.screenHeight - b.screenHeight) > kChange * most;
}
