import type { SetWind } from "./roomMessages";
import type { RoomWind } from "./serverMessages";

/**
 * The wind that this client has asked for, and when it is sent again: the last client to set the room's wind wins, so
 * one that another client has set since stays.
 */
export class RequestedWind {
  /** null: this client has set none, or another one has set one after it */
  #wind: SetWind | null = null;
  /**
   * The server has told no wind since this one was sent: it may have been lost with the connection, so it is sent after
   * the next welcome, whoever has set one.
   */
  #unconfirmed = false;
  /** the first roomWind after a welcome, which tells the wind as it was then */
  #firstDue = false;
  #maySet = false;

  set(wind: SetWind): void {
    this.#wind = wind;
    this.#unconfirmed = true;
  }

  /** The room goes to another server, which may have been told an older wind. */
  onSentOn(): void {
    this.#unconfirmed = this.#wind !== null;
  }

  /** What is to be sent now; null: nothing. `maySet`: the server takes a wind, or refuses it for the first time. */
  onWelcome(maySet: boolean): SetWind | null {
    this.#firstDue = true;
    this.#maySet = maySet;
    return this.#unconfirmed && maySet ? this.#wind : null;
  }

  /** What is to be sent now; null: nothing. */
  onTold(told: RoomWind, ownSession: bigint): SetWind | null {
    const isFirst = this.#firstDue;
    this.#firstDue = false;
    if (isFirst && this.#unconfirmed) return null; // ours reaches the server after it
    this.#unconfirmed = false;
    const isOurs = told.session === ownSession;
    if (told.session !== 0n && !isOurs) this.#wind = null;
    if (isOurs) this.#wind ??= { type: "setWind", wind: told.wind };
    return isFirst && this.#maySet ? this.#wind : null;
  }
}
