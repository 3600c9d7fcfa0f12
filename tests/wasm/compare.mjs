// Runs the module on the cases that hairnet-wasm-cases has written, and compares its results with the native ones.
//   node compare.mjs MODULE.wasm FOLDER
import { readFileSync } from "node:fs";
import { join } from "node:path";
import { start } from "../../client/wasm/glue.mjs";

const [path, folder] = process.argv.slice(2);
const module = await start(readFileSync(path));
const cases = readFileSync(join(folder, "cases"));
const at = module.malloc(cases.length);
new Uint8Array(module.memory.buffer).set(cases, at);
const text = module.same_bits(at, cases.length);
const bytes = new Uint8Array(module.memory.buffer, text);
const got = Buffer.from(bytes.subarray(0, bytes.indexOf(0))).toString().trimEnd().split("\n");
const wanted = readFileSync(join(folder, "expected"), "utf8").trimEnd().split("\n");

// Lines that begin with "~" have a bound there, by which their numbers may differ.
const isNear = (a, b) => {
  const left = a.split(" "), right = b.split(" "), bound = Number(a.slice(1, a.indexOf(" ")));
  return a[0] === "~" && left.length === right.length &&
    left.every((word, i) => word === right[i] || Math.abs(word - right[i]) <= bound);
};
const wrong = wanted.filter((line, i) => line !== got[i] && !isNear(line, got[i] ?? ""));
wrong.forEach((line) => console.log(`differs: ${line.slice(0, 200)}`));
console.log(`${wanted.length} results, ${wrong.length} differ`);
process.exit(wrong.length === 0 && got.length === wanted.length ? 0 : 1);
