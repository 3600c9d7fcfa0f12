// Writes src/generated/constants.ts: the numbers that C++ declares as `constexpr`, most of them its renderer's, so that
// both have the same ones. `constexpr float kCellMin_m = 0.004f;` becomes `export const kCellMinM = 0.004;`.
// Expressions are left out.
import { existsSync, mkdirSync, readFileSync, writeFileSync } from "node:fs";
import { dirname } from "node:path";
import { fileURLToPath } from "node:url";

const kFiles = [
  "schema/limits.hpp",
  "client/c/imports.cpp",
  "client/draw/character_records.cpp",
  "client/draw/character_records.hpp",
  "client/draw/density_grid.cpp",
  "client/draw/density_grid.hpp",
  "client/draw/draw_detail.cpp",
  "client/draw/draw_detail.hpp",
  "client/draw/groom_geometry.hpp",
  "client/draw/hair_motion.hpp",
  "client/draw/mode_texels.hpp",
  "client/render/skin_texture.cpp",
  "client/render/stage.cpp",
  "client/render/strand_deform_pass.hpp",
];
const tree = new URL("../../../", import.meta.url);
const written = fileURLToPath(new URL("../src/generated/constants.ts", import.meta.url));

// The value as JSON, or null where it is an expression. A std::array may have one pair of braces more than it needs.
function numbersOf(value) {
  const text = value
    .replace(/(\d)'/g, "$1")
    .replace(/(\d)f\b/g, "$1")
    .replaceAll("{", "[")
    .replaceAll("}", "]");
  try {
    const numbers = JSON.parse(text);
    return Array.isArray(numbers) && numbers.length === 1 ? numbers[0] : numbers;
  } catch {
    return null;
  }
}

const constants = new Map();
for (const file of kFiles) {
  const text = readFileSync(new URL(file, tree), "utf8").replace(/\/\/.*/g, "");
  for (const [, declared] of text.matchAll(/constexpr (?:int|float|double|std::size_t|std::array<[^;{]*>) (k[^;]*);/g))
    for (const each of declared.split(/,\s*(?=k[A-Z])/)) {
      const [, name, value] = each.match(/^(k\w+)(?: = |(?={))(.*)$/s);
      const here = name.replace(/_(\w)/g, (_, letter) => letter.toUpperCase());
      const numbers = numbersOf(value);
      if (numbers === null) continue;
      if (constants.has(here)) throw new Error(`${file}: another ${here}`);
      constants.set(here, `${JSON.stringify(numbers)}${Array.isArray(numbers) ? " as const" : ""}`);
    }
}
const lines = [...constants].map(([name, numbers]) => `export const ${name} = ${numbers};\n`);
const made = `// Made by scripts/generate.mjs of C++ constants, which say what each is.\n${lines.join("")}`;
// A file that is up to date stays as it is, because other processes may be reading it.
if (!existsSync(written) || readFileSync(written, "utf8") !== made) {
  mkdirSync(dirname(written), { recursive: true });
  writeFileSync(written, made);
}
