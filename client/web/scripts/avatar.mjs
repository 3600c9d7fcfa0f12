// Writes a person made by code as a VRM file, for examples and tests.
import { writeFileSync } from "node:fs";
import { runnerImport } from "vite";

const [file] = process.argv.slice(2);
if (!file) {
  console.error("name the file to write: npm run avatar examples/public/avatar.vrm");
  process.exit(2);
}
const { module } = await runnerImport("./scripts/avatar/madeAvatar.ts");
writeFileSync(file, module.makeAvatar());
