import { expect, test } from "vitest";
import { Person } from "../support/person";
import { Server } from "../support/server";
import { until } from "../support/until";

test("a server that is stopped is heard of, and returned to when it goes on; an idle one is not taken for it", async () => {
  // A connection can die without a word, as when a laptop changes its network. The client notices it after 10 s.
  // The first server is stopped by a signal: its sockets stay open and silent. The second one has nothing to send but
  // signs of life.
  const servers = [new Server(), new Server()];
  const people: Person[] = [];
  try {
    for (const server of servers) {
      await server.start();
      people.push(await Person.join(server.address));
    }
    const [stopped, idle] = people;
    servers[0].pause();
    await until("the room tells that nothing comes", () => stopped.room.state === "reconnecting", 30_000);
    expect(stopped.heard.at(-1)).toBe("reconnecting: the server is silent: nothing came from it for 10 s");
    expect(idle.heard).toEqual(["connected"]);
    servers[0].resume();
    await until("it is there again", () => stopped.room.state === "connected", 30_000);
    expect(stopped.room.counters).toMatchObject({ serversSilent: 1, reconnects: 1, resumes: 1 });
  } finally {
    for (const person of people) person.leave();
    for (const server of servers) await server.dispose();
  }
});
