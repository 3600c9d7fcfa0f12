import { connect, HairnetError, Role, type People, type Room } from "../src/index";
import type { LocalRoom } from "../src/local/index";
import type { Query } from "./query";

export type PersistentRoomState = "connecting" | "connected" | "reconnecting" | "closed" | "refused";

/** The wait before the next attempt grows from the first of these to the second, by a factor of 1.6 each time. */
const kWaitMinS = 1;
const kWaitMaxS = 10;

/**
 * Keeps the page in a room while the page is open. Unlike `connect`, it also retries the first connection, and it joins
 * again when the server has closed the session for a temporary reason. It stops after a permanent refusal.
 */
export class PersistentRoom {
  /** The room of a server; null: there is none now, or the page simulates the hair itself. */
  served: Room | null = null;
  /** The room that this browser simulates alone; null: the page uses a server. */
  local: LocalRoom | null = null;
  #waitS = kWaitMinS;
  #timer: ReturnType<typeof setTimeout> | undefined;

  constructor(
    private readonly query: Query,
    private readonly onRoom: (room: People) => void,
    /** `detail`: the client library's line; `waitS`: until the next attempt, when "closed" or "reconnecting" */
    private readonly onState: (state: PersistentRoomState, detail: string, waitS: number) => void,
    private readonly onError: (detail: string) => void,
  ) {}

  get room(): People | null {
    return this.served ?? this.local;
  }

  /** Makes one attempt to join. Call it once; further attempts follow by themselves. */
  async start(): Promise<void> {
    clearTimeout(this.#timer);
    this.onState("connecting", "", 0);
    try {
      if (this.query.local) {
        // Other pages need not load it.
        this.local = await (await import("../src/local/index")).LocalRoom.open();
        return this.#take(this.local);
      }
      const room = await connect(this.query.server, {
        clientName: "hairnet page",
        room: this.query.room,
        token: this.query.token,
        role: this.query.observe ? Role.observer : Role.participant,
      });
      this.#waitS = kWaitMinS;
      this.served = room;
      this.#take(room);
    } catch (error) {
      if (!(error instanceof HairnetError)) throw error;
      if (error.code !== "unreachable") this.onState("refused", error.message, 0);
      else this.#again(error.message);
    }
  }

  #take(room: People): void {
    room.on("error", ({ detail }) => this.onError(detail));
    room.on("state", ({ state, detail, waitS, isRefused }) => {
      if (state === "closed") {
        this.served = null;
        if (isRefused) this.onState("refused", detail, 0);
        else this.#again(detail);
      } else this.onState(state, detail, waitS);
    });
    this.onRoom(room);
    this.onState("connected", "", 0);
  }

  #again(error: string): void {
    this.onState("closed", error, this.#waitS);
    this.#timer = setTimeout(() => void this.start(), 1000 * this.#waitS);
    this.#waitS = Math.min(1.6 * this.#waitS, kWaitMaxS);
  }
}
