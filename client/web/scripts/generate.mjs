// Writes src/net/generated: what flatc makes of the schema, and the layout of its tables for src/net/verify.ts.
import { execFileSync } from "node:child_process";
import { mkdtempSync, readFileSync, readdirSync, rmSync, writeFileSync, mkdirSync } from "node:fs";
import { dirname, join, resolve } from "node:path";
import { fileURLToPath } from "node:url";
import { tmpdir } from "node:os";
import { layoutOf } from "./layout.mjs";

const here = dirname(fileURLToPath(import.meta.url));
const schemaFolder = resolve(here, "../../../schema");
const outFolder = resolve(here, "../src/net/generated");
const schemas = ["envelope", "session", "pose", "frame", "groom"];

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

rmSync(outFolder, { recursive: true, force: true });
mkdirSync(outFolder, { recursive: true });
flatc(["--ts", "-o", outFolder, ...schemas.map((name) => join(schemaFolder, `${name}.fbs`))]);

// Generated code imports more than it uses.
const classFolder = join(outFolder, "hairnet/wire/fb");
for (const name of readdirSync(classFolder)) {
  const path = join(classFolder, name);
  writeFileSync(path, `// @ts-nocheck\n${readFileSync(path, "utf8")}`);
}
const classes = readdirSync(classFolder)
  .sort()
  .map((name) => `export * from "./hairnet/wire/fb/${name.replace(/\.ts$/, "")}";\n`);
for (const name of schemas) rmSync(join(outFolder, `${name}_generated.ts`));
writeFileSync(join(outFolder, "messages.ts"), classes.join(""));

const scratch = mkdtempSync(join(tmpdir(), "hairnet-schema-"));
try {
  const layouts = {};
  for (const name of ["envelope", "groom"]) {
    flatc(["--binary", "--schema", "-o", scratch, join(schemaFolder, `${name}.fbs`)]);
    Object.assign(layouts, layoutOf(readFileSync(join(scratch, `${name}.bfbs`))));
  }
  writeFileSync(
    join(outFolder, "layout.ts"),
    'import type { TableLayout } from "../verify";\n\n' +
      `export const layouts: Record<string, TableLayout> = ${JSON.stringify(layouts, null, 1)};\n`,
  );
} finally {
  rmSync(scratch, { recursive: true });
}
