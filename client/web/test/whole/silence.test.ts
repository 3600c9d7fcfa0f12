import { describe, expect, it } from "vitest";
import WebSocket from "ws";
import { Link, Room, type WebSocketLike } from "../../src/index";
import { findServer, Server } from "../support/server";
import { until } from "../support/until";

const program = findServer();

describe.skipIf(program === null)("a server that is stopped in the middle of a conversation", () => {
  it("is heard of, and returned to when it goes on; one that is idle is not taken for it", async () => {
    const servers = [new Server(program!), new Server(program!)];
    const rooms: Room[] = [];
    try {
      for (const server of servers) {
        await server.start();
        const makeSocket = (url: string) => new WebSocket(url, "hairnet") as unknown as WebSocketLike;
        const link = new Link(`127.0.0.1:${server.port}`, { makeSocket });
        rooms.push(new Room(link));
        await link.connect();
      }
      const states: string[] = [];
      const [stopped, idle] = rooms;
      stopped.on("state", ({ state, detail }) => states.push(`${state} ${detail}`));
      const hasBecome = (state: string) => () => {
        for (const room of rooms) room.sample(0);
        return stopped.state === state;
      };
      hasBecome("connected")();
      states.length = 0;
      servers[0].pause();
      await until("the room tells that nothing comes", hasBecome("reconnecting"), 30_000);
      expect(states[0]).toBe(
        `reconnecting the server at 127.0.0.1:${servers[0].port} is silent: nothing came from it for 10 s`,
      );
      expect(idle.state).toBe("connected");
      expect(idle.counters.reconnects).toBe(0);
      servers[0].resume();
      await until("it is there again", hasBecome("connected"), 30_000);
      expect(stopped.counters).toMatchObject({ serversSilent: 1, reconnects: 1, resumes: 1 });
    } finally {
      for (const room of rooms) room.close();
      for (const server of servers) await server.dispose();
    }
  }, 90_000);
});
