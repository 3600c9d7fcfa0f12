import { Role } from "./messages";

export interface LinkCoreOptions {
  /** for the server's log */
  readonly clientName: string;
  /** up to 64 letters, digits and . _ -; empty: the room "lobby" */
  readonly room: string;
  /** empty: none */
  readonly token: string;
  readonly role: Role;
  /** from the attempt to the welcome */
  readonly connectTimeoutS: number;
  /** once welcomed; a first attempt that fails is the last */
  readonly reconnect: boolean;
  /** of trying to reconnect; 0: never */
  readonly giveUpAfterS: number;
  /** learnt hair from poses alone: downloads networks, and frames of it are smaller */
  readonly evaluateLearnt: boolean;
  /** that the logs of all its servers name, at most 64 bits; 0n: a link draws one */
  readonly trace: bigint;
  /** of the waits between attempts; from 0 up to 1 */
  readonly random: () => number;
}

export const kDefaultOptions: LinkCoreOptions = {
  clientName: "hairnet-client",
  room: "",
  token: "",
  role: Role.participant,
  connectTimeoutS: 5,
  reconnect: true,
  giveUpAfterS: 0,
  evaluateLearnt: true,
  trace: 0n,
  random: Math.random,
};

export interface LinkCounters {
  bytesSent: number;
  bytesReceived: number;
  /** of packets that hold frames */
  frameBytesReceived: number;
  framesReceived: number;
  /** not taken in time */
  framesDropped: number;
  /** their bytes were wrong */
  framesUndecodable: number;
  /** of no announced member, or not newer than its last frame */
  framesUnknown: number;
  /** without coefficients: this client has evaluated the hair */
  framesEvaluated: number;
  /** without coefficients, and what to evaluate is not here */
  framesLackingLearnt: number;
  /** not sent in time */
  posesDropped: number;
  /** welcomes after the first */
  reconnects: number;
  /** of these, by a server that still had the session */
  resumes: number;
  /** followed, to the server that holds the room */
  redirects: number;
  /** given up, as servers sent it on and on; it asked the first one again */
  redirectLoops: number;
  /** connections given up as nothing came from their server */
  serversSilent: number;
}
