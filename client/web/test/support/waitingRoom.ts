import { startClient } from "../../src/module/client";
import { Link } from "../../src/net/link";
import { Room } from "../../src/room/room";
import { FakeSocket } from "./fakeSocket";

/** A room whose server has not answered yet, for tests that need no answer. 0.001 m is a room's default `errorM`. */
export async function waitingRoom(): Promise<Room> {
  await startClient();
  return new Room(new Link("localhost", { makeSocket: () => new FakeSocket() }, 0.001));
}
