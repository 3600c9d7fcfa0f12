import { spawn, type ChildProcess } from "node:child_process";
import { existsSync, mkdtempSync, rmSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { afterAll, beforeAll, expect, test } from "vitest";
import type { PageViewer } from "../page/viewer";
import { Actor, makeGroomFile } from "./actor";
import { Browser, kServerGone } from "./browser";
import { HairnetServer, until } from "./hairnetServer";
import { freePort } from "./testRun";

const kEtcd = "/usr/bin/etcd";
/** The longest wait for a state of the page or of a server, which nothing reaches on an idle machine. */
const kWaitMs = 60_000;

const browser = new Browser();
const folder = mkdtempSync(join(tmpdir(), "hairnet-fleet-"));
let etcd: ChildProcess | null = null;
let etcdUrl = "";

interface Globals {
  hairnet: PageViewer;
}

/** Measures the longest time in which the actor received no frame, ms. */
function longestGap(actor: Actor): { end(): number } {
  let count = 0;
  let sinceMs = performance.now();
  let longestMs = 0;
  const timer = setInterval(() => {
    const now = performance.now();
    const { framesReceived } = actor.room.counters;
    if (framesReceived !== count) sinceMs = now;
    count = framesReceived;
    longestMs = Math.max(longestMs, now - sinceMs);
  }, 2);
  return {
    end() {
      clearInterval(timer);
      return longestMs;
    },
  };
}

beforeAll(async () => {
  if (!existsSync(kEtcd)) return;
  etcdUrl = `http://127.0.0.1:${await freePort()}`;
  const peerUrl = `http://127.0.0.1:${await freePort()}`;
  etcd = spawn(
    kEtcd,
    [
      ["--data-dir", join(folder, "etcd"), "--listen-client-urls", etcdUrl, "--advertise-client-urls", etcdUrl],
      ["--listen-peer-urls", peerUrl, "--initial-advertise-peer-urls", peerUrl],
      ["--initial-cluster", `default=${peerUrl}`],
    ].flat(),
    { stdio: "ignore" },
  );
  await until("etcd answers", async () => (await fetch(`${etcdUrl}/health`).catch(() => null))?.ok === true);
  await browser.start({ width: 480, height: 320 });
});
afterAll(async () => {
  await browser.dispose();
  etcd?.kill();
  rmSync(folder, { recursive: true, force: true });
});

// An operator stops one server of a fleet for an update. Its people must find their room and their hair on another
// server, without a word to the page.
test.each(["on", "off"])("a page follows its room to another server, with WebTransport %s", async (webTransport) => {
  if (!etcd) return console.warn(`NOT TESTED: there is no ${kEtcd}; deploy/setup installs it`);
  const flags = ["--etcd", etcdUrl, "--fleet-name", `wt-${webTransport}`, "--fleet-address", "127.0.0.1"];
  flags.push("--groom-cache", join(folder, "grooms"), "--webtransport", webTransport);
  const servers = [0, 1].map(() => new HairnetServer(flags));
  for (const server of servers) await server.start();
  const actor = await Actor.join(servers[0].address, "hall", makeGroomFile("bob", 300).bytes);
  try {
    const page = await browser.open(`${servers[0].address}/?room=hall`);
    const showsHair = () =>
      page.waitForFunction(
        () => {
          const { hairnet } = window as unknown as Globals;
          const [other] = [...(hairnet?.room?.members.values() ?? [])].filter((member) => !member.own);
          return (
            hairnet.room?.state === "connected" && other?.pose && hairnet.hair?.characters.get(other.member)?.isReady
          );
        },
        null,
        { timeout: kWaitMs, polling: 100 },
      );
    await showsHair();
    // The fleet has given the room to one of its servers, wherever the clients came in: that one has all sessions.
    const welcomed = await Promise.all(servers.map((server) => server.metric("hairnet_sessions_welcomed_total")));
    const holder = welcomed[0] > 0 ? 0 : 1;
    expect(welcomed[1 - holder]).toBe(0);
    // The head turns for 8 s, because a server does not send hair that rests.
    const turning = actor.turnTo(0.3, 8);
    const gap = longestGap(actor);
    // Both sessions, the page's and the actor's, must then appear on the other server.
    await servers[holder].stop();
    await expect
      .poll(() => servers[1 - holder].metric("hairnet_sessions_welcomed_total"), { timeout: kWaitMs })
      .toBe(2);
    await showsHair();
    await turning;
    console.log(`with WebTransport ${webTransport} the actor's frames had a gap of ${gap.end().toFixed(0)} ms`);
    const look = () =>
      page.evaluate(() => {
        const room = (window as unknown as Globals).hairnet.served!;
        const [other] = [...room.members.values()].filter((member) => !member.own);
        return {
          yaw: other.pose![1],
          transport: room.link.transport,
          reason: room.link.fallbackReason,
          ...room.counters,
        };
      });
    const before = await look();
    await actor.turnTo(0.9, 3);
    // The head turns from 0.3 to 0.9 rad. `yaw` is the sine of half the angle: it grows by 0.29.
    await expect.poll(async () => Math.abs((await look()).yaw - before.yaw), { timeout: kWaitMs }).toBeGreaterThan(0.1);
    const after = await look();
    expect(after.redirects).toBeGreaterThan(0);
    expect(after.transport, after.reason ?? "").toBe(webTransport === "on" ? "webtransport" : "websocket");
    expect(after.framesReceived).toBeGreaterThan(before.framesReceived);
    expect(after.framesUndecodable).toBe(0);
    expect(browser.takeErrors(kServerGone)).toEqual([]);
  } finally {
    actor.leave();
    await browser.closePages();
    for (const server of servers) await server.dispose();
    browser.takeErrors();
  }
});
