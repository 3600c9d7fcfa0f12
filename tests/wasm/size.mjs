// Fails when a module has grown beyond what a page should load.
//   node size.mjs MODULE.wasm KB_MAX
import { readFileSync } from "node:fs";
import { gzipSync } from "node:zlib";

const [path, most] = process.argv.slice(2);
const bytes = readFileSync(path);
const kB = (size) => (size / 1000).toFixed(1);
const packed = gzipSync(bytes, { level: 9 }).length;
console.log(`${path}: ${kB(bytes.length)} kB, ${kB(packed)} kB with gzip; the limit is ${most} kB`);
process.exit(packed <= 1000 * most ? 0 : 1);
