import { describe, expect, it } from "vitest";
import { decodeFrame } from "../../src/net/codec/decodeFrame";
import { FrameIntegers } from "../../src/net/codec/frameIntegers";
import { Neighbours } from "../../src/net/codec/neighbours";
import { fullGrid } from "../support/shapes";
import { fromHex, seeded, vectors } from "../support/vectors";

interface CodecVector {
  name: string;
  dims: [number, number, number];
  active_nodes: number[];
  history: { bones: number[]; nodes: number[] }[];
  has_velocities: boolean;
  content: string;
  bones: number[];
  nodes: number[];
  velocities: number[];
}

const cases = vectors<CodecVector[]>("codec.json");

function neighboursOf(each: CodecVector): Neighbours | null {
  if (each.active_nodes.length === 0) return null;
  return new Neighbours({ ...fullGrid(each.dims), activeNodes: Uint32Array.from(each.active_nodes) });
}

function integersOf(past: { bones: number[]; nodes: number[] }): FrameIntegers {
  const integers = new FrameIntegers();
  integers.bones.set(past.bones);
  integers.resize(past.nodes.length, 0);
  integers.nodes.set(past.nodes);
  return integers;
}

describe("frame codec", () => {
  it("decodes every frame of the C++ encoder to the same integers", () => {
    const out = new FrameIntegers();
    const orders = new Set<number>();
    for (const each of cases) {
      const history = each.history.map(integersOf);
      orders.add(history.length);
      const decoded = decodeFrame(
        fromHex(each.content),
        history,
        history.length,
        neighboursOf(each),
        each.has_velocities,
        out,
      );
      expect(decoded, each.name).toBe(true);
      expect(Array.from(out.bones), each.name).toEqual(each.bones);
      expect(Array.from(out.nodes), each.name).toEqual(each.nodes);
      expect(Array.from(out.velocities), each.name).toEqual(each.velocities);
    }
    expect(orders).toEqual(new Set([0, 1, 2, 3]));
  });

  it("refuses every truncation and an extra byte", () => {
    const out = new FrameIntegers();
    for (const each of cases) {
      const history = each.history.map(integersOf);
      const neighbours = neighboursOf(each);
      const content = fromHex(each.content);
      const longer = new Uint8Array(content.length + 1);
      longer.set(content);
      expect(decodeFrame(longer, history, history.length, neighbours, each.has_velocities, out)).toBe(false);
      for (let length = 0; length < content.length; length += 1 + (content.length >> 6))
        expect(
          decodeFrame(content.subarray(0, length), history, history.length, neighbours, each.has_velocities, out),
        ).toBe(false);
    }
  });

  it("takes any bytes at all without harm", () => {
    const random = seeded(3);
    const out = new FrameIntegers();
    for (let n = 0; n < 20_000; ++n) {
      const each = cases[n % cases.length];
      const content = fromHex(each.content);
      for (let flips = 1 + Math.floor(random() * 8); flips > 0; --flips)
        content[Math.floor(random() * content.length)] ^= 1 << Math.floor(random() * 8);
      const history = each.history.map(integersOf);
      const decoded = decodeFrame(content, history, history.length, neighboursOf(each), each.has_velocities, out);
      expect(typeof decoded).toBe("boolean");
    }
  });

  it("refuses a history of another lattice, or too short a one", () => {
    const each = cases.find((c) => c.history.length === 3 && c.nodes.length > 0)!;
    const out = new FrameIntegers();
    const content = fromHex(each.content);
    const history = each.history.map(integersOf);
    const neighbours = neighboursOf(each);
    expect(decodeFrame(content, history.slice(0, 2), 3, neighbours, each.has_velocities, out)).toBe(false);
    history[1].resize(3, 0);
    expect(decodeFrame(content, history, 3, neighbours, each.has_velocities, out)).toBe(false);
  });

  it("allocates no arrays once it has seen the largest lattice", () => {
    const each = cases.reduce((a, b) => (b.nodes.length > a.nodes.length ? b : a));
    const out = new FrameIntegers();
    const history = each.history.map(integersOf);
    const neighbours = neighboursOf(each);
    const decode = () =>
      decodeFrame(fromHex(each.content), history, history.length, neighbours, each.has_velocities, out);
    decode();
    const { nodes, velocities } = out;
    decode();
    expect(out.nodes).toBe(nodes);
    expect(out.velocities).toBe(velocities);
  });
});
