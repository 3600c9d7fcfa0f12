import { readFileSync } from "node:fs";
import { join } from "node:path";
import { describe, expect, it } from "vitest";
import type { Groom } from "../../src/hair/groom";
import { HairnetError } from "../../src/hair/hairnetError";
import { decodeGroom } from "../../src/net/groomFile";
import { hashGroom } from "../../src/net/groomHash";
import { fromHex, seeded, vectorFolder, vectors } from "../support/vectors";

const cases = vectors<{ file: string; hash: string; groom: unknown }[]>("grooms.json");

function plain(_: string, value: unknown): unknown {
  return ArrayBuffer.isView(value) ? Array.from(value as Float32Array) : value;
}

function attempt(file: Uint8Array): Groom | HairnetError {
  try {
    return decodeGroom(file);
  } catch (error) {
    if (!(error instanceof HairnetError)) throw error;
    expect(error.message).not.toMatch(/\n/);
    return error;
  }
}

describe("groom files", () => {
  it("overlooks learnt hair, which is for servers", () => {
    const read = (name: string) => new Uint8Array(readFileSync(join(vectorFolder, name)));
    const withLearnt = read("bob_learnt.groom");
    expect(withLearnt.length).toBeGreaterThan(read("bob.groom").length + 1000);
    expect(decodeGroom(withLearnt)).toEqual(decodeGroom(read("bob.groom")));
  });

  it("reads every groom as C++ does, with all that can be in one", () => {
    for (const each of cases) {
      const groom = decodeGroom(fromHex(each.file));
      expect(JSON.parse(JSON.stringify(groom, plain))).toEqual(each.groom);
    }
    const grooms = cases.map((each) => each.groom as Groom);
    for (const part of ["clumps", "threads", "cards", "cloths", "knots", "rootBlends"] as const)
      expect(
        grooms.some((groom) => groom[part].length > 0),
        part,
      ).toBe(true);
  });

  it("hashes a file as C++ does", () => {
    for (const each of cases) expect(hashGroom(fromHex(each.file))).toBe(each.hash);
  });

  it("refuses truncations and extra bytes", () => {
    const file = fromHex(cases[7].file);
    for (let length = 0; length < file.length; length += 13)
      expect(attempt(file.slice(0, length))).toBeInstanceOf(HairnetError);
    const longer = new Uint8Array(file.length + 8);
    longer.set(file);
    expect(attempt(longer)).toBeInstanceOf(HairnetError);
  });

  it.each(vectors<{ name: string; file: string }[]>("spoilt_grooms.json"))("refuses $name, as C++ does", ({ file }) => {
    expect(attempt(fromHex(file))).toBeInstanceOf(HairnetError);
  });

  it("reads or refuses 20 000 mutations, and what it reads is sound", () => {
    const random = seeded(5);
    const below = (count: number) => Math.floor(random() * count);
    const small = cases.map((each) => fromHex(each.file)).filter((file) => file.length < 5000);
    let refused = 0;
    for (let n = 0; n < 20_000; ++n) {
      const file = small[below(small.length)].slice();
      const view = new DataView(file.buffer);
      for (let changes = 1 + below(3); changes > 0; --changes) {
        const at = below(file.length - 4);
        const kind = below(3);
        if (kind === 0) file[at] ^= 1 << below(8);
        else if (kind === 1) view.setUint32(at & ~3, [0, 1, 0x7fc00000, 0x7fffffff, 0xffffffff][below(5)], true);
        else view.setUint16(at & ~1, [0, 4, 0x7fff, 0xffff][below(4)], true);
      }
      const groom = attempt(file);
      if (groom instanceof HairnetError) ++refused;
      else expect(groom.points.every(Number.isFinite)).toBe(true);
    }
    expect(refused).toBeGreaterThan(2_000);
    expect(refused).toBeLessThan(20_000);
  });
});
