import { describe, expect, it } from "vitest";
import { RequestedWind } from "../../src/net/requestedWind";

const kOwn = 5n;
const kOther = 99n;

const windOf = (x: number) => ({
  meanMPerS: [x, 0, 0] as [number, number, number],
  gustRatio: 0,
  gustPeriodS: 4,
  turbulenceRmsMPerS: 0,
  turbulenceScaleM: 0.6,
  seed: 1n,
  carried: false,
});

/** Speeds that are sent; 0: nothing is. */
class Asker {
  readonly wind = new RequestedWind();

  set(x: number): void {
    this.wind.set({ type: "setWind", wind: windOf(x) });
  }

  welcome(maySet = true): number {
    return this.wind.onWelcome(maySet)?.wind.meanMPerS[0] ?? 0;
  }

  tell(x: number, session: bigint): number {
    return this.wind.onTold({ type: "roomWind", wind: windOf(x), session }, kOwn)?.wind.meanMPerS[0] ?? 0;
  }
}

/** Its wind has arrived. */
function settled(x: number): Asker {
  const asker = new Asker();
  asker.welcome();
  asker.tell(0, 0n);
  asker.set(x);
  asker.tell(x, kOwn);
  return asker;
}

describe("requested wind", () => {
  it("is none of a client that has set none", () => {
    const asker = new Asker();
    expect([asker.welcome(), asker.tell(3, kOther), asker.welcome(), asker.tell(3, kOther)]).toEqual([0, 0, 0, 0]);
  });

  it("is set again on a server that has its own setting, once", () => {
    const asker = settled(9);
    expect([asker.welcome(), asker.tell(0, 0n), asker.tell(9, kOwn)]).toEqual([0, 9, 0]);
  });

  it("stays replaced, also during an outage", () => {
    const asker = settled(9);
    asker.tell(4, kOther);
    expect([asker.welcome(), asker.tell(0, 0n)]).toEqual([0, 0]);
    for (const by of [kOther, 2n ** 64n - 1n]) {
      const other = settled(9);
      expect([other.welcome(), other.tell(4, by), other.welcome(), other.tell(0, 0n)]).toEqual([0, 0, 0, 0]);
    }
  });

  it("is the newest where it is set after another's", () => {
    const asker = settled(3);
    asker.set(9);
    asker.tell(4, kOther); // while ours is on its way
    asker.tell(9, kOwn);
    expect([asker.welcome(), asker.tell(0, 0n)]).toEqual([0, 9]);
  });

  it("is sent whoever has set one, where it may have been lost", () => {
    const asker = settled(3);
    asker.set(9);
    expect([asker.welcome(), asker.welcome(), asker.tell(4, kOther)]).toEqual([9, 9, 0]);
    asker.tell(9, kOwn);
    expect([asker.welcome(), asker.tell(0, 0n)]).toEqual([0, 9]);
  });

  it("goes along to the next server, unless it was replaced", () => {
    const asker = settled(9);
    asker.wind.onSentOn();
    expect([asker.welcome(), asker.tell(4, 2n ** 64n - 1n)]).toEqual([9, 0]);
    const other = settled(9);
    other.tell(4, kOther);
    other.wind.onSentOn();
    expect(other.welcome()).toBe(0);
  });

  it("is not sent while it may not be set", () => {
    const asker = settled(9);
    expect([asker.welcome(false), asker.tell(0, 0n)]).toEqual([0, 0]);
    asker.set(8);
    expect([asker.welcome(false), asker.tell(0, 0n), asker.welcome()]).toEqual([0, 0, 8]);
  });
});
