import { connect, HairnetError, Role, type Room } from "../src/index";
import type { Query } from "./query";

export type PersistentRoomState = "connecting" | "connected" | "reconnecting" | "closed" | "refused";

const kWaitMinS = 1;
const kWaitMaxS = 10;

/**
 * Keeps the page in a room while the page is open. Unlike `connect`, it also retries the first connection, and it joins
 * again when the server has closed the session for a temporary reason. It stops after a permanent refusal.
 */
export class PersistentRoom {
  room: Room | null = null;
  #waitS = kWaitMinS;
  #timer: ReturnType<typeof setTimeout> | undefined;

  constructor(
    private readonly query: Query,
    private readonly onRoom: (room: Room) => void,
    /** `detail`: the client library's line; `waitS`: until the next attempt, in the states "closed" and "reconnecting" */
    private readonly onState: (state: PersistentRoomState, detail: string, waitS: number) => void,
    private readonly onFault: (detail: string) => void,
  ) {}

  async start(): Promise<void> {
    clearTimeout(this.#timer);
    this.onState("connecting", "", 0);
    try {
      const room = await connect(this.query.server, {
        clientName: "hairnet page",
        room: this.query.room,
        token: this.query.token,
        role: this.query.observe ? Role.observer : Role.participant,
      });
      this.#waitS = kWaitMinS;
      this.#take(room);
    } catch (error) {
      if (!(error instanceof HairnetError)) throw error;
      if (error.code !== "unreachable") this.onState("refused", error.message, 0);
      else this.#again(error.message);
    }
  }

  #take(room: Room): void {
    this.room = room;
    room.on("fault", ({ detail }) => this.onFault(detail));
    room.on("state", ({ state, detail, waitS, isRefused }) => {
      if (state === "closed") {
        this.room = null;
        if (isRefused) this.onState("refused", detail, 0);
        else this.#again(detail);
      } else this.onState(state, detail, waitS);
    });
    this.onRoom(room);
    this.onState("connected", "", 0);
  }

  #again(why: string): void {
    this.onState("closed", why, this.#waitS);
    this.#timer = setTimeout(() => void this.start(), 1000 * this.#waitS);
    this.#waitS = Math.min(1.6 * this.#waitS, kWaitMaxS);
  }
}
