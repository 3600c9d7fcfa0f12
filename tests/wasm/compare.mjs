// Runs same_bits.wasm on the cases that hairnet-wasm-cases has written, and compares its results with the native ones.
//   node compare.mjs same_bits.wasm FOLDER
import { readFileSync } from "node:fs";
import { join } from "node:path";
import { start } from "../../client/wasm/glue.mjs";
import { compare } from "./lines.mjs";

const [path, folder] = process.argv.slice(2);
const module = await start(readFileSync(path));
const cases = readFileSync(join(folder, "cases"));
const at = module.malloc(cases.length);
new Uint8Array(module.memory.buffer).set(cases, at);
const text = module.same_bits(at, cases.length);
const bytes = new Uint8Array(module.memory.buffer, text);
const got = Buffer.from(bytes.subarray(0, bytes.indexOf(0))).toString().trimEnd().split("\n");
compare(got, readFileSync(join(folder, "expected"), "utf8"));
