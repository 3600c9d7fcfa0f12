import { describe, expect, it } from "vitest";
import { kDatagramBytesMax } from "../../src/generated/limits";
import { poseStep, rigidPose } from "../../src/hair/pose";
import { toEarlier, type EarlierPose } from "../../src/net/earlierPose";
import type { PoseBatch, PoseSample } from "../../src/net/messages";
import { decodePacket, encodePacket } from "../../src/net/packet";
import { SentPoses } from "../../src/net/sentPoses";
import { fromEarlier } from "../support/fromEarlier";
import { LinkCoreDriver, addCharacter, kSecond } from "../support/linkCoreDriver";
import { groom } from "../support/memberFrames";

const kPoseNs = 14e6;

const poseOf = (character: number, sequence: number, teleport = false): PoseSample => ({
  character,
  sequence,
  captureTimeNs: sequence * kPoseNs,
  teleport,
  pose: rigidPose(),
});
const range = (count: number): number[] => Array.from({ length: count }, (_, i) => i + 1);
/** Earlier ones first. */
const named = ({ earlier = [], poses }: PoseBatch): string[] => {
  const firstOf = (character: number): PoseSample => poses.find((pose) => pose.character === character)!;
  const before = earlier.map((each) => fromEarlier(each, firstOf(each.character)));
  return [...before, ...poses].map((pose) => `${pose.character}:${pose.sequence}`);
};
const sentWith = (sent: SentPoses, poses: PoseSample[]): string[] => named(sent.repeatIn({ type: "poseBatch", poses }));

describe("sent poses", () => {
  it("come again with the next ones, oldest first", () => {
    const sent = new SentPoses();
    expect(range(4).map((i) => sentWith(sent, [poseOf(1, i)]))).toEqual([
      ["1:1"],
      ["1:1", "1:2"],
      ["1:1", "1:2", "1:3"],
      ["1:2", "1:3", "1:4"],
    ]);
  });

  it("come again with those of their characters", () => {
    const sent = new SentPoses();
    for (const i of range(2)) sentWith(sent, [poseOf(1, i), poseOf(2, i)]);
    expect(sentWith(sent, [poseOf(1, 3), poseOf(2, 3)])).toEqual(["1:1", "1:2", "2:1", "2:2", "1:3", "2:3"]);
    expect(sentWith(sent, [poseOf(2, 4)])).toEqual(["2:2", "2:3", "2:4"]);
    expect(sentWith(sent, [poseOf(2, 5), poseOf(2, 6)])).toEqual(["2:3", "2:4", "2:5", "2:6"]);
  });

  it("do not come again when they are outdated", () => {
    const sent = new SentPoses();
    sentWith(sent, [poseOf(1, 1)]);
    expect(sentWith(sent, [{ ...poseOf(1, 2), captureTimeNs: kPoseNs + 200e6 + 1 }])).toEqual(["1:2"]);
  });
});

describe("earlier poses", () => {
  const turned = (x: number, angle: number): PoseSample["pose"] =>
    rigidPose([0, Math.sin(angle / 2), 0, Math.cos(angle / 2)], [x, 1.6, -0.3]);
  const roundTrip = (batch: PoseBatch): PoseBatch => decodePacket(encodePacket(1, batch)).message as PoseBatch;

  it("travel rounded by a fortieth of a millimetre and a tenth of a milliradian", () => {
    const earlier = { ...poseOf(7, 0xffffffff), captureTimeNs: 5e9 - 28e6, pose: turned(0.31234, 0.7) };
    const later = { ...poseOf(7, 1), captureTimeNs: 5e9, pose: turned(0.35, -0.5) };
    const batch: PoseBatch = { type: "poseBatch", poses: [later], earlier: [toEarlier(earlier, later)!] };
    const read = fromEarlier(roundTrip(batch).earlier![0], later);
    expect(read).toMatchObject({ character: 7, sequence: 0xffffffff, captureTimeNs: 5e9 - 28e6, teleport: false });
    const error = rigidPose();
    poseStep(earlier.pose, read.pose, error);
    for (let at = 0; at < 35; at += 7) {
      expect(2 * Math.hypot(error[at], error[at + 1], error[at + 2])).toBeLessThan(1e-4);
      for (let c = at + 4; c < at + 7; ++c) expect(Math.abs(error[c])).toBeLessThan(2.6e-5);
    }
  });

  it("do not fit where they differ too much", () => {
    const later = { ...poseOf(1, 5), captureTimeNs: 5e9 };
    const fits = (change: Partial<PoseSample>): boolean =>
      toEarlier({ ...later, sequence: 4, ...change }, later) !== null;
    expect(fits({})).toBe(true);
    expect(fits({ pose: turned(2, 0) })).toBe(false);
    expect(fits({ pose: turned(0, 2.2) })).toBe(false);
    expect(fits({ captureTimeNs: 5e9 + 1 })).toBe(false);
    expect(fits({ captureTimeNs: 5e9 - 2 ** 32 })).toBe(false);
    expect(fits({ sequence: 5 })).toBe(false);
    expect(fits({ sequence: 5 - 70_000 + 2 ** 32 })).toBe(false);
  });

  it("are refused without a pose of their character, or beyond their number", () => {
    const driver = new LinkCoreDriver();
    driver.join();
    const earlierOf = (character: number): EarlierPose => toEarlier(poseOf(character, 1), poseOf(character, 2))!;
    const send = (earlier: EarlierPose[]) => () =>
      driver.core.send({ type: "poseBatch", poses: [poseOf(1, 20)], earlier });
    expect(send([earlierOf(2)])).toThrow("which has no pose");
    expect(send([{ ...earlierOf(1), sequenceBefore: 0 }])).toThrow("with the sequence of the pose");
    expect(send(range(17).map(() => earlierOf(1)))).toThrow("earlier poses");
  });
});

describe("poses over datagrams", () => {
  const joinedDriver = (): LinkCoreDriver => {
    const driver = new LinkCoreDriver();
    driver.open(true);
    driver.tell(driver.welcome());
    for (const character of range(3)) driver.core.send(addCharacter(character, groom));
    driver.sent();
    return driver;
  };
  const push = (driver: LinkCoreDriver, sequence: number, characters = 1): string[][] => {
    driver.core.pushPoses(range(characters).map((character) => poseOf(character, sequence)));
    return driver.sent().map((message) => named(message as PoseBatch));
  };

  it("are all there though two of three datagrams get lost", () => {
    const driver = joinedDriver();
    const come = new Set<string>();
    for (const i of range(90)) {
      const [batch] = push(driver, i);
      if (i % 3 === 0) for (const pose of batch) come.add(pose);
    }
    expect(come.size).toBe(90);
  });

  it("take several datagrams for many characters, and the channel for a crowd", () => {
    const driver = joinedDriver();
    for (const i of range(2)) push(driver, i, 32);
    driver.core.pushPoses(range(32).map((character) => poseOf(character, 3)));
    let count = 0;
    for (let packet = driver.core.takePacket(driver.nowNs); packet; packet = driver.core.takePacket(driver.nowNs)) {
      expect(packet.length).toBeLessThanOrEqual(kDatagramBytesMax);
      expect(named(decodePacket(packet).message as PoseBatch).length).toBe(count < 10 ? 9 : 6);
      ++count;
    }
    expect(count).toBe(11);
    expect(push(driver, 4, 33)).toHaveLength(1);
  });

  it("of a removed character, or an earlier connection, do not come again", () => {
    const driver = joinedDriver();
    push(driver, 1);
    driver.core.send({ type: "removeCharacter", character: 1 });
    driver.core.send(addCharacter(1, groom));
    driver.sent();
    expect(push(driver, 2)).toEqual([["1:2"]]);
    driver.break();
    driver.pass(6 * kSecond);
    driver.open(true);
    driver.tell(driver.welcome({ resumed: true }));
    driver.sent();
    expect(push(driver, 3)).toEqual([["1:3"]]);
  });

  it("do not come again with a jump, which travels alone, nor the jump", () => {
    const driver = joinedDriver();
    push(driver, 1);
    driver.core.pushPoses([poseOf(1, 2, true)]);
    expect(driver.sent().map((message) => named(message as PoseBatch))).toEqual([["1:2"]]);
    expect(driver.core.takenMayBeLost).toBe(false);
    expect(push(driver, 3)).toEqual([["1:1", "1:3"]]);
  });

  it("come once where there are no datagrams", () => {
    const driver = new LinkCoreDriver();
    driver.join();
    expect(range(3).map((i) => push(driver, i, 3)[0].length)).toEqual([3, 3, 3]);
  });
});
