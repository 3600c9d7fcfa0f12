import { existsSync } from "node:fs";
import { join, resolve } from "node:path";

/** The folder of Hairnet's programs: HAIRNET_BIN, by default that of the release build. */
export const kBin = resolve(process.env.HAIRNET_BIN ?? resolve(__dirname, "../../../../build/release/bin"));

/** The path of the program `name`, such as "hairnet-server". Throws an error that says how to build it. */
export function program(name: string): string {
  const path = join(kBin, name);
  if (!existsSync(path)) throw new Error(`${path} is missing: build it (ninja ${name}), or set HAIRNET_BIN`);
  return path;
}
