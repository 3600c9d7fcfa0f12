import { describe, expect, it } from "vitest";
import { kSecond, LinkCoreDriver } from "../support/linkCoreDriver";

const kEmpty = { type: "frameBatch", tick: 1, sampleTimeNs: 0, frames: [], generations: new Uint8Array() } as const;

function joined(signsOfLife = true): LinkCoreDriver {
  const driver = new LinkCoreDriver();
  driver.join({ signsOfLife });
  driver.events();
  return driver;
}

/** Passes time as its owner does: it polls at the deadlines that the core names, or as late as `timerNs` allows. */
function pass(driver: LinkCoreDriver, ns: number, timerNs = 0): void {
  const endNs = driver.nowNs + ns;
  while (driver.nowNs < endNs) {
    const waitNs = Math.max(driver.core.nextDeadlineNs - driver.nowNs, timerNs, 1e6);
    driver.pass(Math.min(waitNs, endNs - driver.nowNs));
    driver.sent();
  }
}

describe("a silent server", () => {
  it("is given up after ten seconds, and asked again", () => {
    const driver = joined();
    pass(driver, 9.9 * kSecond);
    expect(driver.eventTypes()).toEqual([]);
    pass(driver, 0.1 * kSecond);
    expect(driver.events()).toMatchObject([
      { type: "reconnecting", detail: "the server is silent: nothing came from it for 10 s" },
    ]);
    expect(driver.core.counters.serversSilent).toBe(1);
    expect(driver.core.wantsClose).toBe(true);
    driver.break("");
    driver.rejoin({ signsOfLife: true, resumed: true });
    expect(driver.eventTypes()).toEqual(["connected"]);
  });

  it("is one from which nothing comes: an empty batch of frames is a sign of life", () => {
    const driver = joined();
    for (let n = 0; n < 20; ++n) {
      pass(driver, 9 * kSecond);
      driver.tell(kEmpty);
    }
    expect(driver.eventTypes()).toEqual([]);
  });

  it("is not taken for one that promises no signs of life", () => {
    const driver = joined(false);
    pass(driver, 100 * kSecond);
    expect(driver.eventTypes()).toEqual([]);
  });

  it("is not what a page in the background makes of one that speaks", () => {
    for (const timerS of [1, 60]) {
      const driver = joined();
      // Its messages are read after the timer that has been kept from running.
      for (let s = 0; s < 600; s += timerS) {
        pass(driver, timerS * kSecond, timerS * kSecond);
        if (s % 3 === 0) driver.tell(kEmpty);
      }
      expect(driver.eventTypes()).toEqual([]);
    }
  });

  it("is not one that spoke while this program was stopped", () => {
    const driver = joined();
    driver.pass(3600 * kSecond);
    driver.pass(1 * kSecond);
    driver.tell(kEmpty);
    expect(driver.eventTypes()).toEqual([]);
  });
});
