import { expect, test } from "vitest";
import { importHair, type HairFile, type ImportOptions } from "../../src/import/index";
import { Groom, HairnetError, type ErrorCode } from "../../src/index";
import { objText } from "../support/objText";

const file = (name: string, text: string): HairFile => ({
  name,
  size: text.length,
  arrayBuffer: () => new Blob([text]).arrayBuffer(),
});
// The file has 200 strands, in metres with +y upwards.
const obj = objText(200);

test("strands of another program become a .groom file, with lines that say what was guessed", async () => {
  const { groom, remarks } = await importHair([file("curls.obj", obj)]);
  expect(remarks[0]).toMatch(/^curls\.obj: taken as up \+y, face \S+, \S+ m a unit, roots first$/);
  for (const remark of remarks) expect(remark).toMatch(/^curls\.obj: .+/);
  const read = await Groom.load(groom);
  expect(read.name).toBe("curls");
  expect(read.strandCount).toBe(200);
});

// An .obj file does not say which way is up, nor its unit. A wrong guess makes hair that lies on its side, or is 100
// times too large, so what the user knows must count.
test("what is known is not guessed", async () => {
  const known: ImportOptions = { name: "mine", up: "+y", face: "-x", roots: "last", unitM: 1 };
  const { groom, remarks } = await importHair([file("curls.obj", obj)], known);
  expect(remarks[0]).toMatch(/^curls\.obj: taken as up \+y, face -x, 1 m a unit, roots last$/);
  expect((await Groom.load(groom)).name).toBe("mine");
});

test("several files are one head", async () => {
  const half = objText(100);
  const { groom } = await importHair([file("a.obj", obj), file("b.obj", half)]);
  expect((await Groom.load(groom)).strandCount).toBe(300);
});

test("what makes no hairstyle is told in one line", async () => {
  const refusal = async (files: readonly HairFile[], options?: ImportOptions): Promise<[ErrorCode, string]> => {
    const error = await importHair(files, options).catch((thrown: unknown) => thrown);
    expect(error).toBeInstanceOf(HairnetError);
    const { code, message } = error as HairnetError;
    expect(message).not.toContain("\n");
    return [code, message];
  };
  // The refusals are for no file, another format than the name says, a line break in the name, a file above 512 MiB
  // (kImportMiBMax), one that cannot be read, values that are no list of files, and wrong options.
  expect(await refusal([])).toEqual(["invalid", expect.stringContaining("0 files")]);
  expect(await refusal([file("curls.abc", obj)])).toEqual([
    "malformed",
    expect.stringMatching(/^curls\.abc: not an Al/),
  ]);
  expect(await refusal([file("cu\nrls.abc", "")])).toEqual(["malformed", "cu\\u000arls.abc: is empty"]);
  expect(await refusal([{ ...file("a.obj", obj), size: 2 ** 30 }])).toEqual([
    "invalid",
    expect.stringContaining("512"),
  ]);
  const gone: HairFile = { name: "gone.obj", arrayBuffer: () => Promise.reject(new Error("it was moved")) };
  expect(await refusal([gone])).toEqual(["invalid", "gone.obj cannot be read: it was moved"]);
  for (const wrong of [null, "a.obj", [obj], file("a.obj", obj)])
    expect(await refusal(wrong as unknown as HairFile[])).toEqual(["invalid", expect.stringContaining("give files")]);
  const good = [file("curls.obj", obj)];
  expect(await refusal(good, { up: "north" })).toEqual(["invalid", expect.stringContaining("up: an axis is one of")]);
  expect(await refusal(good, { unitM: Number.NaN })).toEqual(["invalid", expect.stringContaining("unit_m")]);
  expect(await refusal(good, { unit: 1 } as ImportOptions)).toEqual([
    "unknown_option",
    expect.stringContaining("did you mean 'unitM'?"),
  ]);
});
