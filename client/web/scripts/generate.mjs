// Writes src/net/generated: flatc's output for the schema, and the layout of its tables for src/net/verify.ts. Does not
// touch files that are up to date, because other processes may be reading them.
import { execFileSync } from "node:child_process";
import { existsSync, mkdirSync, mkdtempSync, readFileSync, readdirSync, rmSync, writeFileSync } from "node:fs";
import { dirname, join, resolve } from "node:path";
import { fileURLToPath } from "node:url";
import { tmpdir } from "node:os";
import { constantsOf } from "./constants.mjs";
import { layoutOf } from "./layout.mjs";

const here = dirname(fileURLToPath(import.meta.url));
const root = resolve(here, "../../..");
const schemaFolder = join(root, "schema");
const outFolder = resolve(here, "../src");
const schemas = ["enums", "types", "messages", "groom", "basis", "learnt"];
const classFolder = "hairnet/wire/fb";
const flatcFolder = "net/generated";

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

const camelCase = (name) => name.replace(/_([a-z0-9])/g, (_, letter) => letter.toUpperCase());

// The enums of enums.fbs by name: their own comment and their values.
function readEnums() {
  const text = readFileSync(join(schemaFolder, "enums.fbs"), "utf8");
  const enums = text.matchAll(/\/\/\/ (.*)\nenum (\w+) : ubyte \{([^}]*)\}/g);
  return new Map([...enums].map(([, comment, name, body]) => [name, { comment, values: body.match(/\w+/g) }]));
}

function enumsText(enums) {
  const blocks = [...enums].map(
    ([name, { comment, values }]) =>
      `/** ${comment} */\nexport enum ${name} {\n${values.map((value) => `  ${camelCase(value)},\n`).join("")}}\n` +
      `export const k${name}Last = ${name}.${camelCase(values.at(-1))};\n`,
  );
  return `// Made from schema/enums.fbs.\n\n${blocks.join("\n")}`;
}

const numberOf = (type, text) => {
  const number = Number(text.replaceAll("'", "").replace(/f$/, ""));
  return type === "float" ? Math.fround(number) : number;
};

// The constants of schema/limits.hpp, and the members of core's GroomLimits.
function limitsText() {
  const limits = readFileSync(join(schemaFolder, "limits.hpp"), "utf8");
  const lines = ["// Made from schema/limits.hpp and core/groom/groom.hpp.\n\n"];
  for (const [, type, name, value] of limits.matchAll(/^inline constexpr ([\w:]+) (k\w+) = ([\d'.f]+);/gm))
    lines.push(`export const ${camelCase(name)} = ${numberOf(type, value)};\n`);
  const [, rule] = limits.match(/kRoomNameRule = (".*");/);
  lines.push(`export const kRoomNameRule = ${rule};\n`);
  const groom = readFileSync(join(root, "core/groom/groom.hpp"), "utf8").match(/struct GroomLimits \{([^}]*)\}/)[1];
  lines.push("export const kGroomLimits = {\n");
  for (const [, type, name, value] of groom.matchAll(/([\w:]+) (\w+) = ([\d'.f]+);/g))
    lines.push(`  ${camelCase(name)}: ${numberOf(type, value)},\n`);
  return `${lines.join("")}} as const;\n`;
}

// Returns the generated files by path.
function generate(scratch) {
  const files = new Map();
  flatc(["--ts", "-o", scratch, ...schemas.map((name) => join(schemaFolder, `${name}.fbs`))]);
  const enums = readEnums();
  const enumValues = new RegExp(`\\b(${[...enums.keys()].join("|")})\\.(\\w+)`, "g");
  const names = readdirSync(join(scratch, classFolder)).sort();
  for (const name of names) {
    const text = readFileSync(join(scratch, classFolder, name), "utf8");
    const [, enumName] = text.match(/^export enum (\w+)/m) ?? [];
    // Generated code imports more than it uses. It shares our enums.
    files.set(
      join(flatcFolder, classFolder, name),
      enums.has(enumName)
        ? `export { ${enumName} } from "../../../../../generated/enums";\n`
        : `// @ts-nocheck\n${text.replace(enumValues, (_, of, value) => `${of}.${camelCase(value)}`)}`,
    );
  }
  files.set("generated/enums.ts", enumsText(enums));
  files.set("generated/limits.ts", limitsText());
  files.set("generated/constants.ts", constantsOf(root));
  const classes = names.map((name) => `export * from "./${classFolder}/${name.replace(/\.ts$/, "")}";\n`);
  files.set(join(flatcFolder, "messages.ts"), classes.join(""));

  const layouts = {};
  for (const name of ["messages", "groom", "basis", "learnt"]) {
    flatc(["--binary", "--schema", "-o", scratch, join(schemaFolder, `${name}.fbs`)]);
    Object.assign(layouts, layoutOf(readFileSync(join(scratch, `${name}.bfbs`))));
  }
  files.set(
    join(flatcFolder, "layout.ts"),
    'import type { TableLayout } from "../verify";\n\n' +
      `export const layouts: Record<string, TableLayout> = ${JSON.stringify(layouts, null, 1)};\n`,
  );
  return files;
}

const scratchFolder = mkdtempSync(join(tmpdir(), "hairnet-schema-"));
try {
  const files = generate(scratchFolder);
  for (const folder of ["generated", flatcFolder, join(flatcFolder, classFolder)]) {
    mkdirSync(join(outFolder, folder), { recursive: true });
    for (const name of readdirSync(join(outFolder, folder))) {
      if (/\.ts$/.test(name) && !files.has(join(folder, name))) rmSync(join(outFolder, folder, name));
    }
  }
  for (const [name, text] of files) {
    const path = join(outFolder, name);
    if (!existsSync(path) || readFileSync(path, "utf8") !== text) writeFileSync(path, text);
  }
} finally {
  rmSync(scratchFolder, { recursive: true });
}
