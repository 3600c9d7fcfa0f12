// Packs the package as `npm publish` does, which builds it, and lets publint and "are the types wrong" judge the
// archive. Then each of its entries starts the hair module, whether it lies beside or inside. Exits with 1 when
// something is wrong.
import { spawnSync } from "node:child_process";
import { mkdtempSync, readdirSync, rmSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";

// npx fetches it, at this version, for this check alone: with its own TypeScript it is 38 MB in 52 packages. It asks
// for Node 20, so that npm would warn at each installation on Debian 12; it works with Node 18.
const kAttw = "@arethetypeswrong/cli@0.18.5";

function succeeds(command, ...args) {
  return spawnSync(command, args, { stdio: "inherit" }).status === 0;
}

// The module itself says what is wrong with the bytes. Each entry gets a process, because they share the module.
function starts(file, call) {
  const program = `
    const entry = await import(${JSON.stringify(file)});
    const error = await entry.${call}.catch((error) => error);
    if (error.code !== "malformed") throw error;`;
  return succeeds(process.execPath, "--input-type=module", "--eval", program);
}

const folder = mkdtempSync(join(tmpdir(), "hairnet-package-"));
try {
  const isPacked = succeeds("npm", "pack", "--loglevel=error", "--pack-destination", folder);
  const archive = isPacked && join(folder, readdirSync(folder)[0]);
  const isValid = isPacked && succeeds("npx", "publint", "--strict", archive);
  // The package has ES modules only: `require` and resolution older than `exports` are no problems.
  const isTyped = isPacked && succeeds("npx", "--yes", "--loglevel=error", kAttw, archive, "--profile", "esm-only");
  const isUnpacked = isPacked && succeeds("tar", "-xzf", archive, "-C", folder);
  const starting = {
    "index.js": "Groom.load(new Uint8Array(1))",
    "inline.js": "Groom.load(new Uint8Array(1))",
    "local.js": "buildLevels(new Uint8Array(1))",
    "import.js": 'importHair([{ name: "a.abc", arrayBuffer: () => new ArrayBuffer(1) }])',
  };
  const isStarted =
    isUnpacked && Object.entries(starting).every(([name, call]) => starts(join(folder, "package/dist", name), call));
  if (!isValid || !isTyped || !isStarted) process.exitCode = 1;
} finally {
  rmSync(folder, { recursive: true });
}
