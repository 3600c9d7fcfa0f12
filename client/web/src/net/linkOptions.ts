import { checkOptions } from "../hair/checkOptions";
import { HairnetError } from "../module/hairnetError";
import type { TransportChoice } from "./fallbackSocket";
import type { WebSocketLike } from "./socket";

export enum Role {
  participant,
  /** has no characters of its own */
  observer,
}

export interface LinkOptions {
  /** for the server's log */
  readonly clientName?: string;
  /** up to 64 letters, digits and . _ -; empty: the room "lobby" */
  readonly room?: string;
  /** empty: none */
  readonly token?: string;
  readonly role?: Role;
  /** from the attempt to the welcome */
  readonly connectTimeoutS?: number;
  /** once welcomed; a first attempt that fails is the last */
  readonly reconnect?: boolean;
  /** of trying to reconnect; 0: never */
  readonly giveUpAfterS?: number;
  /** "auto" by default: WebTransport where browser, server and network have it, else a WebSocket */
  readonly transport?: TransportChoice;
  /** makes sockets; by default the platform's WebTransport, or its WebSocket with the subprotocol "hairnet" */
  readonly makeSocket?: (url: string) => WebSocketLike;
  /** this client's monotonic clock, ns; by default performance.now() */
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
