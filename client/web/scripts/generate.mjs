// Writes src/net/generated: flatc's output for the schema, and the layout of its tables for src/net/verify.ts. Does not
// touch files that are up to date, because other processes may be reading them.
import { execFileSync } from "node:child_process";
import { existsSync, mkdirSync, mkdtempSync, readFileSync, readdirSync, rmSync, writeFileSync } from "node:fs";
import { dirname, join, resolve } from "node:path";
import { fileURLToPath } from "node:url";
import { tmpdir } from "node:os";
import { layoutOf } from "./layout.mjs";

const here = dirname(fileURLToPath(import.meta.url));
const schemaFolder = resolve(here, "../../../schema");
const outFolder = resolve(here, "../src/net/generated");
const schemas = ["envelope", "session", "pose", "frame", "groom"];
const classFolder = "hairnet/wire/fb";

function flatc(args) {
  try {
    execFileSync(process.env.FLATC ?? "flatc", args, { stdio: ["ignore", "pipe", "pipe"] });
  } catch (error) {
    const isMissing = error.code === "ENOENT";
    const why = isMissing ? "flatc is not installed (Debian: flatbuffers-compiler)" : String(error.stderr || error);
    console.error(`generate: ${why.trim()}`);
    process.exit(1);
  }
}

// Returns the folder's files by path.
function generate(scratch) {
  const files = new Map();
  flatc(["--ts", "-o", scratch, ...schemas.map((name) => join(schemaFolder, `${name}.fbs`))]);
  const names = readdirSync(join(scratch, classFolder)).sort();
  for (const name of names) {
    // Generated code imports more than it uses.
    files.set(join(classFolder, name), `// @ts-nocheck\n${readFileSync(join(scratch, classFolder, name), "utf8")}`);
  }
  const classes = names.map((name) => `export * from "./${classFolder}/${name.replace(/\.ts$/, "")}";\n`);
  files.set("messages.ts", classes.join(""));

  const layouts = {};
  for (const name of ["envelope", "groom"]) {
    flatc(["--binary", "--schema", "-o", scratch, join(schemaFolder, `${name}.fbs`)]);
    Object.assign(layouts, layoutOf(readFileSync(join(scratch, `${name}.bfbs`))));
  }
  files.set(
    "layout.ts",
    'import type { TableLayout } from "../verify";\n\n' +
      `export const layouts: Record<string, TableLayout> = ${JSON.stringify(layouts, null, 1)};\n`,
  );
  return files;
}

const scratch = mkdtempSync(join(tmpdir(), "hairnet-schema-"));
try {
  const files = generate(scratch);
  mkdirSync(join(outFolder, classFolder), { recursive: true });
  for (const name of readdirSync(join(outFolder, classFolder))) {
    if (!files.has(join(classFolder, name))) rmSync(join(outFolder, classFolder, name));
  }
  for (const [name, text] of files) {
    const path = join(outFolder, name);
    if (!existsSync(path) || readFileSync(path, "utf8") !== text) writeFileSync(path, text);
  }
} finally {
  rmSync(scratch, { recursive: true });
}
