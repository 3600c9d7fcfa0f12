import { existsSync, readdirSync, readFileSync } from "node:fs";
import { join } from "node:path";
import { Vector3 } from "three";
import { describe, expect, test } from "vitest";
import { makeAvatar } from "../../scripts/avatar/madeAvatar";
import { HairnetError } from "../../src/module/hairnetError";
import { kVrmBytesMax, loadVrm, lowerArms, VrmHair } from "../../src/vrm/index";
import { madeGroom } from "../support/madeGroom";

// GLTFLoader asks for the browser's global object.
(globalThis as { self?: unknown }).self ??= globalThis;

const text = (words: string) => new TextEncoder().encode(words);
const model = makeAvatar();

/** The error with which a file is refused: a `HairnetError` of one line, as the page shows it to people. */
async function refusal(bytes: Uint8Array): Promise<HairnetError> {
  const error: unknown = await loadVrm(bytes).then(
    () => "loaded",
    (reason: unknown) => reason,
  );
  expect(error).toBeInstanceOf(HairnetError);
  expect((error as HairnetError).message).not.toContain("\n");
  return error as HairnetError;
}

/** A model with another description: `change` gets its JSON. */
function described(change: (json: Record<string, unknown>) => void, file: Uint8Array = model): Uint8Array {
  // A glTF file begins with a header of 12 bytes, whose number at 8 is the size of the file. The size of the JSON is at
  // 12, and the JSON begins at 20.
  const bytes = new DataView(file.buffer, file.byteOffset).getUint32(12, true);
  const json = JSON.parse(new TextDecoder().decode(file.subarray(20, 20 + bytes))) as Record<string, unknown>;
  change(json);
  const words = text(JSON.stringify(json));
  const textBytes = 4 * Math.ceil(words.length / 4);
  const out = new Uint8Array(file.length - bytes + textBytes).fill(0x20);
  out.set(file.subarray(0, 20));
  out.set(words, 20);
  out.set(file.subarray(20 + bytes), 20 + textBytes);
  new DataView(out.buffer).setUint32(8, out.length, true);
  new DataView(out.buffer).setUint32(12, textBytes, true);
  return out;
}

describe("what is no VRM model is refused in plain words", () => {
  // A user may drop any file. Each line has a name, the file, and what the refusal must say: what it is, or what helps.
  test.each([
    ["an empty file", new Uint8Array(0), /it is empty/],
    ["a licence", text("MIT License\n\nCopyright (c)"), /it is a text/],
    ["glTF as text", text('{"asset":{"version":"2.0"}}'), /VRM file is one binary file/],
    ["an archive", text("PK\u0003\u0004..........................."), /Unpack it first/],
    ["a web page", text("<!doctype html><html></html>"), /Download the model itself/],
    ["unknown bytes", Uint8Array.from({ length: 64 }, (_, n) => 200 - 3 * n), /first bytes are unknown/],
    ["a file that is cut off", model.subarray(0, model.length - 1000), /cut off/],
    ["a header alone", model.subarray(0, 20), /cut off/],
    ["glTF without VRM", described((json) => delete json.extensions), /without VRM data.*Export it as VRM/],
    ["links to other files", described((json) => (json.images = [{ uri: "https://example.com/a.png" }])), /one file/],
    ["a VRM without bones", described(removeBones), /required|bones|skeleton/i],
  ])("%s", async (_, bytes, words) => {
    expect((await refusal(bytes)).message).toMatch(words);
  });

  test("a description that is no JSON", async () => {
    const bytes = model.slice();
    // The JSON begins with an exclamation mark.
    bytes[20] = 0x21;
    expect((await refusal(bytes)).message).toMatch(/damaged/);
  });

  test("an old version of glTF", async () => {
    const bytes = model.slice();
    // The number at 4 is the version of glTF.
    bytes[4] = 1;
    expect((await refusal(bytes)).message).toMatch(/old version/);
  });

  test("more vertices than the limit, whatever the file's own size", async () => {
    // The limit is 64 Mi numbers in all arrays (kVrmNumbersMax of loadVrm.ts). The small file claims 3e9 vertices.
    const bytes = described((json) => ((json.accessors as { count: number }[])[0].count = 3e9));
    const error = await refusal(bytes);
    expect(error.code).toBe("too_large");
    for (const count of [-1, 1.5, null, "many"]) {
      const odd = described((json) => ((json.accessors as { count: unknown }[])[0].count = count));
      expect((await refusal(odd)).message).toMatch(/no valid length/);
    }
  });

  test("a file that is too large", async () => {
    const error = await refusal(new Uint8Array(kVrmBytesMax + 1));
    expect(error.code).toBe("too_large");
    expect(error.message).toMatch(/129 MB; a VRM file may have 128 MB/);
  });

  // A download that breaks off leaves a file of any length, from none to all but one byte.
  test("truncations to 97 lengths", async () => {
    for (let n = 0; n < 97; ++n) await refusal(model.subarray(0, Math.round((n / 96) * (model.length - 1))));
  });
});

function removeBones(json: Record<string, unknown>): void {
  const { VRMC_vrm: vrm } = json.extensions as { VRMC_vrm: { humanoid: { humanBones: object } } };
  vrm.humanoid.humanBones = {};
}

const folder = process.env.HAIRNET_AVATARS ?? "../../../shared/data/avatar";
const files = existsSync(folder) ? readdirSync(folder).filter((name) => name.endsWith(".vrm")) : [];
if (files.length === 0)
  process.stderr.write(`SKIPPED: no VRM models in ${folder} (HAIRNET_AVATARS names another folder)\n`);

describe.skipIf(files.length === 0)("models of others", () => {
  test.each(files)("%s lowers its arms and gets hair of the size of its head", async (name) => {
    // Node has no pictures: nothing may refer to them.
    const file = new Uint8Array(readFileSync(join(folder, name)));
    const vrm = await loadVrm(described((json) => dropTextures(json), file));
    lowerArms(vrm);
    const vrmHair = new VrmHair(vrm);
    vrmHair.fit(madeGroom());
    // The size is that of the model's head over the groom's. Heads of comic figures are several times as large as a
    // real head.
    expect(vrmHair.size).toBeGreaterThan(0.8);
    expect(vrmHair.size).toBeLessThan(7);
    vrm.update(0.1);
    vrm.scene.updateMatrixWorld(true);
    const height = (bone: "leftHand" | "rightHand" | "leftUpperArm" | "rightUpperArm") =>
      vrm.humanoid.getRawBoneNode(bone)!.getWorldPosition(new Vector3()).y;
    // A model stands with its arms spread, and its hands are then about as high as its upper arms. Lowered hands must
    // be at least 10 cm lower.
    expect(height("leftHand")).toBeLessThan(height("leftUpperArm") - 0.1);
    expect(height("rightHand")).toBeLessThan(height("rightUpperArm") - 0.1);
  });
});

function dropTextures(value: unknown): unknown {
  if (typeof value !== "object" || value === null) return value;
  const record = value as Record<string, unknown>;
  for (const key of Object.keys(record)) {
    if (key === "textureProperties") record[key] = {};
    else if (/texture$|^images$|^textures$|image$|^icon$/i.test(key)) delete record[key];
    else dropTextures(record[key]);
  }
  return value;
}
