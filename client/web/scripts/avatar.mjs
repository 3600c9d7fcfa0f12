// Writes the viewer's default avatar as a VRM file.
import { writeFileSync } from "node:fs";
import { runnerImport } from "vite";

const [file] = process.argv.slice(2);
if (!file) {
  console.error("name the file to write: npm run avatar examples/public/default_avatar.vrm");
  process.exit(2);
}
const { module } = await runnerImport("./page/avatar/defaultAvatar.ts");
writeFileSync(file, module.makeDefaultAvatar());
