// Prepares dist/types for the package, after tsc has written it. Relative imports get the ending .js, which Node's own
// module resolution requires. Files that no entry of package.json reaches are removed: they declare private code.
import { existsSync, readdirSync, readFileSync, rmSync, writeFileSync } from "node:fs";
import { dirname, join, resolve } from "node:path";
import { fileURLToPath } from "node:url";

const packageFolder = resolve(dirname(fileURLToPath(import.meta.url)), "..");
const typesFolder = join(packageFolder, "dist/types");

// The declarations of the package's entries.
function entryFiles() {
  const { exports: entries } = JSON.parse(readFileSync(join(packageFolder, "package.json"), "utf8"));
  return Object.values(entries).flatMap(({ types }) => (types ? [join(packageFolder, types)] : []));
}

// The declarations that the file imports as "./level.js".
function declarationOf(file, specifier) {
  return resolve(dirname(file), specifier.replace(/\.js$/, ".d.ts"));
}

// "./level" becomes "./level.js", "./room" becomes "./room/index.js".
function specifierOf(file, specifier) {
  const ending = [".js", "/index.js"].find((each) => existsSync(declarationOf(file, specifier + each)));
  if (!ending) throw new Error(`${file}: no declarations for "${specifier}"`);
  return specifier + ending;
}

// Adds the file, and all files that it imports, to `reached`, with complete imports.
function complete(file, reached) {
  if (reached.has(file)) return;
  reached.add(file);
  const imported = [];
  const text = readFileSync(file, "utf8").replace(/\b(from |import |import\()"(\.[^"]*)"/g, (_, keyword, specifier) => {
    const withEnding = specifierOf(file, specifier);
    imported.push(declarationOf(file, withEnding));
    return `${keyword}"${withEnding}"`;
  });
  writeFileSync(file, text);
  for (const each of imported) complete(each, reached);
}

const publicFiles = new Set();
for (const file of entryFiles()) complete(file, publicFiles);
for (const entry of readdirSync(typesFolder, { recursive: true })) {
  const file = join(typesFolder, entry);
  if (file.endsWith(".d.ts") && !publicFiles.has(file)) rmSync(file);
}
