import { existsSync } from "node:fs";
import { join, resolve } from "node:path";
import { inject } from "vitest";
import { Server } from "../test/support/server";

export { until } from "../test/support/until";

/** The folder of hairnet-server, hairnet-view and hairnet-groom: HAIRNET_BIN, by default that of the release build. */
export const kBin = resolve(process.env.HAIRNET_BIN ?? "../../build/release/bin");
export const kPage = resolve("dist-page");

export function program(name: string): string {
  const path = join(kBin, name);
  if (!existsSync(path)) throw new Error(`${path} is missing: build it (ninja ${name}), or set HAIRNET_BIN`);
  return path;
}

/** A server with its own port that serves the built page. */
export class HairnetServer extends Server {
  /** By default pages get a WebSocket, which is everywhere. */
  constructor(flags: readonly string[] = ["--webtransport", "off"]) {
    const own = ["--web-root", kPage, "--workers", "1", "--level-cache", inject("levelCache"), "--learn-hair", "never"];
    super(program("hairnet-server"), [...own, ...flags]);
  }

  get address(): string {
    return `http://127.0.0.1:${this.port}`;
  }

  /** A number of /metrics; 0: it is not there. */
  async metric(name: string): Promise<number> {
    const text = await (await fetch(`${this.address}/metrics`)).text();
    const line = text.split("\n").find((each) => each.startsWith(`${name} `));
    return Number(line?.split(" ")[1] ?? 0);
  }
}
