// Writes compressed copies beside the files of a folder: FILE.br and FILE.gz, where they are at least a tenth smaller.
// hairnet-server and most web servers hand them out under the file's own name. Removes copies that are out of date.
//   node scripts/compress.mjs FOLDER
import { existsSync, readdirSync, readFileSync, rmSync, statSync, writeFileSync } from "node:fs";
import { extname, join } from "node:path";
import { brotliCompressSync, constants, gzipSync } from "node:zlib";

const kEndings = new Set(
  ".css .glb .gltf .glsl .groom .hdr .html .js .json .levels .map .md .mjs .svg .task .tflite .txt .vrm .wasm .webmanifest".split(
    " ",
  ),
);
// A copy is written if it has at most this share of the file's own bytes.
const kShareMax = 0.9;
// Larger files get a lower quality of brotli: the best one takes two seconds a megabyte.
const kSlowBrotliBytesMax = 1 << 20;

function brotli(bytes) {
  const quality = bytes.length <= kSlowBrotliBytesMax ? 11 : 9;
  const mode = constants.BROTLI_PARAM_QUALITY;
  return brotliCompressSync(bytes, { params: { [mode]: quality, [constants.BROTLI_PARAM_SIZE_HINT]: bytes.length } });
}

const kCodings = [
  { ending: ".gz", compress: (bytes) => gzipSync(bytes, { level: 9 }) },
  { ending: ".br", compress: brotli },
];

const folder = process.argv[2];
if (!folder || !existsSync(folder) || !statSync(folder).isDirectory()) {
  console.error("compress.mjs: give a folder whose files are to be compressed");
  process.exit(2);
}
const files = readdirSync(folder, { recursive: true })
  .map((name) => join(folder, name))
  .sort();
const isCopy = (path) => kCodings.some(({ ending }) => path.endsWith(ending));
for (const path of files.filter(isCopy)) rmSync(path);
const sums = { file: 0, ".gz": 0, ".br": 0 };
for (const path of files) {
  if (isCopy(path) || !kEndings.has(extname(path)) || !statSync(path).isFile()) continue;
  const bytes = readFileSync(path);
  sums.file += bytes.length;
  for (const { ending, compress } of kCodings) {
    const copy = compress(bytes);
    const isWorthIt = copy.length <= kShareMax * bytes.length;
    if (isWorthIt) writeFileSync(path + ending, copy);
    sums[ending] += isWorthIt ? copy.length : bytes.length;
  }
}
const kB = (bytes) => `${(bytes / 1000).toFixed(0)} kB`;
console.log(`${folder}: ${kB(sums.file)}, with gzip ${kB(sums[".gz"])}, with brotli ${kB(sums[".br"])}`);
