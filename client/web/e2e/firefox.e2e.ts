import { afterAll, beforeAll, expect, test } from "vitest";
import type { PageViewer } from "../page/viewer";
import { Actor, makeGroomFile } from "./actor";
import { Firefox } from "./firefox";
import { HairnetServer } from "./hairnetServer";

/** Firefox draws in software here, so it may take long for its first picture. */
const kWaitMs = 90_000;

const server = new HairnetServer([]);
const firefox = new Firefox();
let actor: Actor;

interface Globals {
  hairnet: PageViewer;
}

beforeAll(async () => {
  await server.start();
  actor = await Actor.join(server.address, "fox", makeGroomFile("bob", 300).bytes);
  await firefox.start();
});
afterAll(async () => {
  actor?.leave();
  await firefox.dispose();
  await server.dispose();
});

test("in Firefox hair moves over WebTransport, poses and frames as datagrams", async () => {
  const page = await firefox.open(`http://localhost:${server.port}/?room=fox`);
  await page.waitForFunction(
    () => {
      const { hairnet } = window as unknown as Globals;
      const [other] = hairnet?.room?.members.values() ?? [];
      return other?.pose && hairnet.hair?.characters.get(other.member)?.isReady;
    },
    { timeout: kWaitMs, polling: 200 },
  );
  const look = () =>
    page.evaluate(() => {
      const room = (window as unknown as Globals).hairnet.served!;
      const [other] = room.members.values();
      const { framesReceived, framesUndecodable } = room.counters;
      return { transport: room.link.transport, yaw: other.pose![1], framesReceived, framesUndecodable };
    });
  // The actor's head turns by 0.6 rad within 3 s, because a server does not send hair that rests.
  const before = await look();
  await actor.turnTo(0.6, 3);
  const after = await look();
  expect(after.transport).toBe("webtransport");
  expect(after.framesReceived).toBeGreaterThan(before.framesReceived);
  expect(after.framesUndecodable).toBe(0);
  // `yaw` is the sine of half the angle, so 0.6 rad are 0.3 of it.
  expect(Math.abs(after.yaw - before.yaw)).toBeGreaterThan(0.1);
  expect(await server.metric('hairnet_connections_opened_total{transport="webtransport"}')).toBe(1);
  expect(await server.metric("hairnet_quic_datagrams_sent_total")).toBeGreaterThan(20);
  // With hair of its own the page sends poses: the server must get them in datagrams, too.
  await page.click("#join-button");
  await expect
    .poll(() => server.metric("hairnet_quic_datagrams_received_total"), { timeout: kWaitMs })
    .toBeGreaterThan(20);
});
