import { afterAll, beforeAll, expect, test } from "vitest";
import { connect, HairnetError, ModerateAction, type WebSocketLike } from "../../src/index";
import { strandsFile } from "../support/grooms";
import { GuardedServer } from "../support/guardedServer";
import { openSocket, Person } from "../support/person";
import { until } from "../support/until";

// Tokens carry what their owner may do: `--wind off` forbids to set the wind, and `--moderate` allows to remove people
// and to lock the room. `--subject` names the person, for the log and for moderators.
const server = new GuardedServer();
beforeAll(() => server.start());
afterAll(() => server.dispose());

test("a server refuses a token in one line, and who may set the wind", async () => {
  const refusal = await connect(server.address, {
    token: "none",
    makeSocket: (url) => openSocket(url) as unknown as WebSocketLike,
  }).catch((error: unknown) => error);
  expect(refusal).toBeInstanceOf(HairnetError);
  expect(refusal).toMatchObject({ code: "refused", message: expect.stringMatching(/^[^\n]*token[^\n]*$/) });
  const calm = await Person.join(server.address, { token: server.token("--wind", "off") });
  expect(calm.room.maySetWind).toBe(false);
  calm.room.setWind({ speed: 3 });
  // The first line is "connected". The second one must be the refusal, and the air stays still.
  await until("it is told", () => calm.heard.length > 1);
  expect(calm.heard[1]).toMatch(/^error: the server refuses: [^\n]+$/);
  expect(calm.room.wind.meanMPerS).toEqual([0, 0, 0]);
  calm.leave();
});

test("a moderator removes people and locks the room; others may not", async () => {
  const judge = await Person.join(server.address, { token: server.token("--moderate", "--subject", "judge") });
  const eve = await Person.join(server.address, { token: server.token("--subject", "eve") });
  const mallory = await Person.join(server.address, { token: server.token("--subject", "mallory") });
  for (const person of [eve, mallory]) person.own = person.room.addCharacter(await strandsFile(20, 6));
  // Wrong arguments are refused here, without a word to the server.
  expect(() => judge.room.moderate(ModerateAction.remove, "sub:mallory", -1)).toThrow("the seconds of a ban are -1");
  expect(() => judge.room.moderate(9 as ModerateAction)).toThrow("moderate: there is no 9");
  // Eve's token does not allow it, so the server must refuse: otherwise anyone could close a room.
  eve.room.moderate(ModerateAction.lock);
  await until("she is refused", () => eve.heard.some((line) => line.startsWith("error: the server refuses: ")));

  const ends: unknown[] = [];
  for (const { room } of [eve, mallory])
    room.on("state", ({ state, detail, isRefused }) => ends.push({ state, detail, isRefused }));
  const whose = () => judge.room.memberOf(eve.room.session, eve.own!.character);
  await until("she is here", () => whose() !== null);
  // Eve is named by her character, and banned for 60 s. Mallory is named by the subject of the token.
  judge.room.moderate(ModerateAction.remove, whose()!, 60, "be kind");
  await until("she is removed", () => eve.room.state === "closed");
  // She learns the reason, and `isRefused` tells her page not to come back by itself.
  expect(ends).toEqual([{ state: "closed", detail: expect.stringContaining("be kind"), isRefused: true }]);
  expect(eve.room.members.size).toBe(0);
  judge.room.moderate(ModerateAction.lock);
  judge.room.moderate(ModerateAction.remove, "sub:mallory");
  await until("so is another, by name", () => mallory.room.state === "closed");
  await until("both have left", () => judge.room.members.size === 0);
  const late = Person.join(server.address, { token: server.token("--subject", "late") });
  await expect(late).rejects.toThrow(/locked/);
  expect(judge.heard.filter((line) => line.startsWith("error"))).toEqual([]);
  judge.leave();
});
