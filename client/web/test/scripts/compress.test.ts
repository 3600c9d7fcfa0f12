import { execFileSync } from "node:child_process";
import { randomBytes } from "node:crypto";
import { mkdirSync, mkdtempSync, readdirSync, readFileSync, rmSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { brotliDecompressSync, gunzipSync } from "node:zlib";
import { afterEach, beforeEach, describe, expect, it } from "vitest";

let folder = "";
beforeEach(() => {
  folder = mkdtempSync(join(tmpdir(), "hairnet-compress-"));
  mkdirSync(join(folder, "grooms"));
});
afterEach(() => rmSync(folder, { recursive: true }));

const compress = (...words: string[]) =>
  execFileSync(process.execPath, ["scripts/compress.mjs", ...words], { encoding: "utf8", stdio: "pipe" });
const names = () => readdirSync(folder, { recursive: true }).map(String).sort();

describe("compress.mjs", () => {
  it("writes copies that hold the file's own bytes", () => {
    const text = "const hair = 1;\n".repeat(500);
    writeFileSync(join(folder, "index.js"), text);
    // A file of 2 MB is above the limit up to which the best quality is used.
    writeFileSync(join(folder, "grooms/long.groom"), Buffer.alloc(2 << 20, 7));
    expect(compress(folder)).toContain(folder);
    expect(gunzipSync(readFileSync(join(folder, "index.js.gz"))).toString()).toBe(text);
    expect(brotliDecompressSync(readFileSync(join(folder, "index.js.br"))).toString()).toBe(text);
    expect(brotliDecompressSync(readFileSync(join(folder, "grooms/long.groom.br")))).toHaveLength(2 << 20);
  });

  it("writes none that gains less than a tenth, and none of pictures", () => {
    // Random bytes do not shrink, and a picture is compressed already: its ending is not in the list of the script.
    writeFileSync(join(folder, "noise.groom"), randomBytes(5000));
    writeFileSync(join(folder, "empty.js"), "");
    writeFileSync(join(folder, "picture.png"), Buffer.alloc(5000));
    compress(folder);
    expect(names()).toEqual(["empty.js", "grooms", "noise.groom", "picture.png"]);
  });

  // A web server hands out the copy in place of the file, so an old copy would be an old page.
  it("removes copies of files that have changed or gone", () => {
    writeFileSync(join(folder, "gone.js.br"), "old");
    writeFileSync(join(folder, "now.css"), randomBytes(100));
    writeFileSync(join(folder, "now.css.gz"), "old");
    compress(folder);
    expect(names()).toEqual(["grooms", "now.css"]);
  });

  it("asks for a folder", () => {
    expect(() => compress()).toThrow(/give a folder/);
    expect(() => compress(join(folder, "none"))).toThrow(/give a folder/);
  });
});
