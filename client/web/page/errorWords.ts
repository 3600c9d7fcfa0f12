import { isolated } from "./isolated";

// Errors in plain words: what happened, and what helps.

/** How the client library begins the line of a connection that the server has ended, before the server's own words. */
const kGoodbye = /^the server says goodbye:? ?/;

/**
 * What the page says of a connection that could not be made, or has ended, and that it tries again in `waitS` seconds.
 * `server`: the server's address; `detail`: the client library's line.
 */
export function closedWords(server: string, detail: string, waitS: number): string {
  const again = `The page tries again in ${Math.ceil(waitS)} s.`;
  if (kGoodbye.test(detail))
    return `The server ended the connection: ${sentence(detail.replace(kGoodbye, ""))} ${again}`;
  return `The server does not answer at ${addressOf(server)}. ${again}`;
}

/**
 * What the page says of a request that the server refuses now and would refuse again. `detail`: the library's line, in
 * which words tell what the server means; `hasToken`: the page's address has a token.
 */
export function refusedWords(detail: string, hasToken: boolean): string {
  const error = detail.replace(kGoodbye, "");
  if (/taken over|another connection/i.test(error)) return `${sentence(error)} Reload this page to come back.`;
  if (/removed|banned/i.test(error)) return sentence(error);
  if (!/token|malformed|expired|signature|wrong_room/i.test(error)) return sentence(error);
  if (!hasToken) return "This room needs a token. Ask the person who invited you for an address with ?token=…";
  const kNew = "Ask the person who invited you for a new address.";
  if (/expired/i.test(error))
    return `${/\d/.test(error) ? sentence(error) : "The token in this address has expired."} ${kNew}`;
  if (/room/i.test(error))
    return `${/ /.test(error) ? sentence(error) : "The token in this address is for another room."} ${kNew}`;
  return `The token in this address is not valid${/ /.test(error) ? `: ${error}` : ""}. ${kNew}`;
}

/** What the page says of files of other programs of which no hairstyle could be made. `error`: the importer's line. */
export function foreignFileWords(fileNames: readonly string[], error: string): string {
  const scene = fileNames.find((name) => /\.(ass|fbx|blend|ma|mb|max|c4d|hip)$/i.test(name));
  if (scene) return `The page does not read ${isolated(scene)}: export its hair as .abc or .usd, and give that.`;
  // The importer's line may name flags of a program, such as --up. The page has no such flags and always guesses how
  // hair lies, so a user who knows it must run the program.
  const cure = /--\w/.test(error) ? ` (flags of hairnet-groom import, which makes a .groom file of it)` : "";
  return `${isolated(error)}${cure}`;
}

/** The server's address as people type it: without the scheme and path. */
function addressOf(server: string): string {
  return server.replace(/^\w+:\/\//, "").replace(/\/(ws)?$/, "");
}

/** The line as a sentence: with a capital, spaces in place of "_" between letters, and a full stop. */
function sentence(line: string): string {
  const text = line.trim().replaceAll(/(?<=[a-z])_(?=[a-z])/g, " ");
  if (!text) return "The server gave no reason.";
  return `${isolated(text[0].toUpperCase() + text.slice(1))}${/[.!?]$/.test(text) ? "" : "."}`;
}

/** The message of what was thrown, whatever it is. */
export function messageOf(thrown: unknown): string {
  return thrown instanceof Error ? thrown.message : String(thrown);
}
