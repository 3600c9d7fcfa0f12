import { afterAll, afterEach, beforeEach, expect, test, vi } from "vitest";
import WebSocket from "ws";
import { PersistentRoom, type PersistentRoomState } from "../../page/persistentRoom";
import { ModerateAction } from "../../src/index";
import { strandsFile } from "../support/grooms";
import { GuardedServer } from "../support/guardedServer";
import { Person } from "../support/person";
import { until } from "../support/until";

const server = new GuardedServer();

/**
 * A page with a PersistentRoom, and what that reported: its states without repetitions, the newest detail, and errors.
 */
class Page {
  readonly states: PersistentRoomState[] = [];
  readonly errors: string[] = [];
  readonly session: PersistentRoom;
  last = "";

  constructor(query: { room?: string; token?: string }) {
    this.session = new PersistentRoom(
      { room: "hall", server: server.address, token: "", observe: false, local: false, ...query },
      () => {},
      (state, detail) => {
        if (state !== this.states.at(-1)) this.states.push(state);
        this.last = detail;
      },
      (detail) => this.errors.push(detail),
    );
  }
}

beforeEach(() => void vi.stubGlobal("WebSocket", WebSocket));
afterEach(() => void vi.unstubAllGlobals());
afterAll(() => server.dispose());

test("a server that is not there is tried again until it is; a permanent refusal is not", async () => {
  // The server has chosen its port at the first start. After its end nothing listens there until the second one.
  await server.start();
  await server.kill();
  const page = new Page({ token: server.token("--subject", "eve") });
  await page.session.start();
  expect(page.states).toEqual(["connecting", "closed"]);
  expect(page.last).toMatch(/^no server answers at 127\.0\.0\.1:\d+: is hairnet-server running there\?$/);
  await server.start();
  await until("it is there", () => page.session.room !== null);
  expect(page.states).toEqual(["connecting", "closed", "connecting", "connected"]);

  // A room's name has no spaces, and "none" is no token: the next attempt would be refused as well.
  for (const query of [{ room: "no such name" }, { token: "none" }]) {
    const refused = new Page(query);
    await refused.session.start();
    expect(refused.states).toEqual(["connecting", "refused"]);
    expect(refused.session.room).toBeNull();
  }

  // A moderator removes Eve for 60 s. A page that came back by itself would make that pointless.
  const moderator = await Person.join(server.address, { room: "hall", token: server.token("--moderate") });
  const room = page.session.room!;
  room.addCharacter(await strandsFile(20, 6), { tag: "Eve" });
  moderator.room.moderate(ModerateAction.remove, await moderator.meets("Eve"), 60, "be kind");
  await until("it is told", () => {
    room.sample(0);
    return page.states.at(-1) === "refused";
  });
  expect(page.last).toContain("be kind");
  expect(page.session.room).toBeNull();
  moderator.leave();
});
