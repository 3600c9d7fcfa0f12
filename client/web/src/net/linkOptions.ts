import { checkOptions } from "../hair/checkOptions";
import { HairnetError } from "../module/hairnetError";
import type { TransportChoice } from "./fallbackSocket";
import type { WebSocketLike } from "./socket";

/** What a client may do in a room. */
export enum Role {
  participant,
  /** Has no characters of its own, and only watches. */
  observer,
}

/** How a client connects. `kClientDefaults` has the default values. */
export interface LinkOptions {
  /** The program's name, for the server's log. */
  readonly clientName?: string;
  /** The room's name: up to 64 letters, digits and . _ -; empty: the room "lobby". */
  readonly room?: string;
  /** What lets this client into a guarded server (`hairnet-token make`); empty: none. */
  readonly token?: string;
  readonly role?: Role;
  /** The time for an attempt, from its start to the server's welcome. */
  readonly connectTimeoutS?: number;
  /** Whether the room reconnects after it was welcomed once. A first attempt that fails is always the last. */
  readonly reconnect?: boolean;
  /** The room closes after reconnecting has failed for this time; 0: it never gives up. */
  readonly giveUpAfterS?: number;
  /** How packets travel; "auto" by default: see `TransportChoice`. */
  readonly transport?: TransportChoice;
  /** Makes a socket. By default it is the platform's WebTransport, or its WebSocket with the subprotocol "hairnet". */
  readonly makeSocket?: (url: string) => WebSocketLike;
  /** Returns the time of a monotonic clock, ns; by default that of performance.now(). */
  readonly nowNs?: () => number;
}

/** @internal */
export const kClientDefaults = {
  clientName: "hairnet-client",
  room: "",
  token: "",
  role: Role.participant,
  connectTimeoutS: 5,
  reconnect: true,
  giveUpAfterS: 0,
};
/** A function, for `checkLinkOptions`, which compares types only. */
const kNoFunction = (): never => {
  throw new Error("it stands for any function");
};
/** @internal One value of each option's type. */
export const kLinkOptions: Readonly<Record<keyof LinkOptions, unknown>> = {
  ...kClientDefaults,
  transport: "auto",
  makeSocket: kNoFunction,
  nowNs: kNoFunction,
};
const kTransportChoices: readonly string[] = ["auto", "webtransport", "websocket"] satisfies TransportChoice[];

/** @internal Throws `HairnetError` unless each option is in `known`, with the type of its default. */
export function checkLinkOptions<T extends object>(options: T, known: Readonly<Record<keyof T, unknown>>): void {
  checkOptions(options, known, "connect");
  for (const [name, value] of Object.entries(options)) {
    const wanted = typeof known[name as keyof T];
    if (value !== undefined && typeof value !== wanted)
      throw new HairnetError("invalid", `connect: the option '${name}' is a ${wanted}, not ${String(value)}`);
    if (name === "transport" && value !== undefined && !kTransportChoices.includes(String(value)))
      throw new HairnetError("invalid", `connect: the option 'transport' is one of ${kTransportChoices.join(", ")}`);
  }
}
