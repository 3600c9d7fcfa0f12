import { afterAll, afterEach, beforeAll, expect, test } from "vitest";
import { strandsFile } from "../support/grooms";
import { Person } from "../support/person";
import { Server } from "../support/server";
import { until } from "../support/until";

const server = new Server();
const people: Person[] = [];
beforeAll(() => server.start());
afterEach(() => {
  for (const person of people.splice(0)) person.leave();
});
afterAll(() => server.dispose());

test("everyone and everything is there again after a broken line, and on a new server", async () => {
  const file = await strandsFile(20, 6);
  const ann = await Person.join(server.address);
  const ben = await Person.join(server.address);
  people.push(ann, ben);
  ann.own = ann.room.addCharacter(file, { tag: "Ann", appearance: { hairRoot: 0x9e5930 } });
  const second = ann.room.addCharacter(file, { tag: "Anna" });
  ben.room.setWind({ speed: 1, from: 0 });
  const seen = await ben.meets("Ann");
  await until("her hair moves", () => seen.lattice !== null && seen.groom !== null);
  const { groom } = seen;

  // Her line breaks without a goodbye. The session goes on over a new connection, with what she has changed meanwhile:
  // to him she has never left.
  const { session } = ann.room;
  ann.socket.terminate();
  ann.own.setAppearance({ skin: 0x0a0b0c }, "Annabel");
  await until("she is back", () => ann.room.counters.resumes === 1);
  await until("he is told", () => seen.tagText === "Annabel");
  expect(ann.room.session).toBe(session);
  expect(ann.room.counters.reconnects).toBe(1);
  expect(ann.heard).toContain("reconnecting: the connection broke");
  expect(ben.named("Annabel")).toBe(seen);
  expect(ben.heard.filter((line) => line.startsWith("left"))).toEqual([]);

  // The server dies, and a new one starts on its port. It knows nobody, so both clients must bring their characters
  // again, and he meets her as a new member.
  await server.kill();
  await until("both notice", () => [ann, ben].every(({ room }) => room.state === "reconnecting"));
  expect(ann.heard.at(-1)).toMatch(/^reconnecting: [^\n]+$/);
  await server.start();
  const isBack = ({ room }: Person) => room.state === "connected" && room.members.size === 2;
  await until("both are back with everyone", () => [ann, ben].every(isBack));
  const anew = await ben.meets("Annabel");
  await until("her hair moves again", () => anew.lattice !== null && anew.groom !== null);
  expect(anew).not.toBe(seen);
  expect(anew.groom!.key).toBe(groom!.key);
  expect(anew).toMatchObject({ session: ann.room.session, appearance: { hairRoot: 0x9e5930, skin: 0x0a0b0c } });
  expect(ann.own.member).toBe(ann.named("Annabel"));
  expect(second.member).toBe(ann.named("Anna"));
  await until("the wind blows again", () => ann.room.wind.meanMPerS[2] !== 0);
  expect(ann.room.counters).toMatchObject({ resumes: 1, framesUndecodable: 0 });
  expect([...ann.heard, ...ben.heard].filter((line) => line.startsWith("error"))).toEqual([]);
});

test("a room that may not reconnect, or has tried long enough, is closed with the reason", async () => {
  const ann = await Person.join(server.address, { reconnect: false });
  // He tries to reconnect for 0.2 s, and she not at all.
  const ben = await Person.join(server.address, { giveUpAfterS: 0.2 });
  people.push(ann, ben);
  await server.kill();
  await until("both have ended", () => [ann, ben].every(({ room }) => room.state === "closed"));
  expect(ann.heard).toEqual(["connected", expect.stringMatching(/^closed: [^\n]*the connection broke$/)]);
  expect(ben.heard.at(-1)).toMatch(/^closed: [^\n]+$/);
});
