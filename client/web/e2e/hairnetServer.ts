import { resolve } from "node:path";
import { Server } from "../test/support/server";

export { kBin, program } from "../test/support/programs";
export { until } from "../test/support/until";

/** The built page (npm run build:page). */
export const kPage = resolve("dist-page");

/** A server with its own port that serves the built page. */
export class HairnetServer extends Server {
  /** By default pages get a WebSocket, which is everywhere. */
  constructor(flags: readonly string[] = ["--webtransport", "off"]) {
    super(["--web-root", kPage, ...flags]);
  }

  /** A number of /metrics; 0: it is not there. */
  async metric(name: string): Promise<number> {
    const text = await (await fetch(`${this.address}/metrics`)).text();
    const line = text.split("\n").find((each) => each.startsWith(`${name} `));
    return Number(line?.split(" ")[1] ?? 0);
  }
}
