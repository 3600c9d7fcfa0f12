import { afterEach, beforeEach, expect, test, vi } from "vitest";
import { PersistentRoom, type PersistentRoomState } from "../../page/persistentRoom";
import { LinkCoreDriver } from "../support/linkCoreDriver";
import { serverPacket } from "../support/serverPacket";
import { GoodbyeReason, type ServerMessage } from "../../src/net/messages";

/** The page's WebSocket, controlled by the test. */
class FakeSocket {
  static made: FakeSocket[] = [];
  binaryType = "";
  bufferedAmount = 0;
  onopen?: () => void;
  onmessage?: (event: { data: unknown }) => void;
  onclose?: (event: { code: number; reason: string }) => void;
  constructor() {
    FakeSocket.made.push(this);
  }
  send(): void {}
  close(): void {}
  tell(message: ServerMessage): void {
    const packet = serverPacket(1e9, message);
    this.onmessage?.({ data: packet.buffer.slice(packet.byteOffset, packet.byteOffset + packet.length) });
  }
}

beforeEach(() => {
  FakeSocket.made = [];
  vi.useFakeTimers();
  vi.stubGlobal("WebSocket", FakeSocket);
});
afterEach(() => {
  vi.unstubAllGlobals();
  vi.useRealTimers();
});

function begin(room = "hall"): { states: PersistentRoomState[]; session: PersistentRoom; started: Promise<void> } {
  const states: PersistentRoomState[] = [];
  const query = { room, server: "http://localhost:7420", token: "", observe: false };
  const session = new PersistentRoom(
    query,
    () => {},
    (state) => states.push(state),
    () => {},
  );
  return { states, session, started: session.start() };
}

test("a server that is not there is tried again", async () => {
  const { states, started } = begin();
  FakeSocket.made[0].onclose?.({ code: 1006, reason: "" });
  await started;
  expect(states).toEqual(["connecting", "closed"]);
  vi.advanceTimersByTime(60_000);
  expect(FakeSocket.made.length).toBeGreaterThan(1);
});

test("a permanent refusal is reported and not tried again", async () => {
  const wrong = begin("no such name");
  await wrong.started;
  expect(wrong.states).toEqual(["connecting", "refused"]);
  expect(FakeSocket.made).toHaveLength(0);

  const refused = begin();
  FakeSocket.made[0].onopen?.();
  FakeSocket.made[0].tell({ type: "goodbye", reason: GoodbyeReason.tokenRefused, detail: "expired" });
  await refused.started;
  expect(refused.states).toEqual(["connecting", "refused"]);

  const later = begin();
  FakeSocket.made[1].onopen?.();
  FakeSocket.made[1].tell(new LinkCoreDriver().welcome());
  await later.started;
  FakeSocket.made[1].tell({ type: "goodbye", reason: GoodbyeReason.sessionTakenOver, detail: "" });
  later.session.room!.sample(0);
  expect([...new Set(later.states)]).toEqual(["connecting", "connected", "refused"]);
  vi.advanceTimersByTime(60_000);
  expect(FakeSocket.made).toHaveLength(2);
});
