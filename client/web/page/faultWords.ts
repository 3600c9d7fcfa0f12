import { isolated } from "./isolated";

// Errors in plain words: what happened, and what helps.

const kGoodbye = /^the server says goodbye:? ?/;

/** A connection that could not be made, or has ended, and is tried again in `waitS`. `server`: its address. */
export function closedWords(server: string, detail: string, waitS: number): string {
  const again = `The page tries again in ${Math.ceil(waitS)} s.`;
  if (kGoodbye.test(detail))
    return `The server ended the connection: ${sentence(detail.replace(kGoodbye, ""))} ${again}`;
  return `The server does not answer at ${addressOf(server)}. ${again}`;
}

/** A request that the server refuses now and would refuse again. */
export function refusedWords(detail: string, hasToken: boolean): string {
  const why = detail.replace(kGoodbye, "");
  if (/taken over|another connection/i.test(why)) return `${sentence(why)} Reload this page to come back.`;
  if (/removed|banned/i.test(why)) return sentence(why);
  if (!/token|malformed|expired|signature|wrong_room/i.test(why)) return sentence(why);
  if (!hasToken) return "This room needs a token. Ask the person who invited you for an address with ?token=…";
  const kNew = "Ask the person who invited you for a new address.";
  if (/expired/i.test(why))
    return `${/\d/.test(why) ? sentence(why) : "The token in this address has expired."} ${kNew}`;
  if (/room/i.test(why))
    return `${/ /.test(why) ? sentence(why) : "The token in this address is for another room."} ${kNew}`;
  return `The token in this address is not valid${/ /.test(why) ? `: ${why}` : ""}. ${kNew}`;
}

/** A dropped or chosen file that is neither a groom nor an avatar: what makes a groom of it. */
export function foreignFileWords(fileName: string): string {
  const name = isolated(fileName);
  const stem = isolated(fileName.replace(/\.[^.]*$/, ""));
  if (/\.(hair|tfx|data|abc|usd[acz]?|ply|np[yz]|obj)$/i.test(fileName))
    return `If ${name} holds strands, this command makes a hairstyle of it: hairnet-groom import ${name} --out ${stem}.groom`;
  if (/\.(ass|fbx|blend|glb|gltf)$/i.test(fileName))
    return (
      `The page does not read ${name}. Export its hair as .abc or .usd; ` +
      `then hairnet-groom import FILE --out ${stem}.groom makes a hairstyle of it.`
    );
  return `The page does not read ${name}: give it a hairstyle (.groom) or an avatar (.vrm).`;
}

/** The server's address as people type it: without the scheme and path. */
function addressOf(server: string): string {
  return server.replace(/^\w+:\/\//, "").replace(/\/(ws)?$/, "");
}

function sentence(line: string): string {
  const text = line.trim().replaceAll(/(?<=[a-z])_(?=[a-z])/g, " ");
  if (!text) return "The server gave no reason.";
  return `${isolated(text[0].toUpperCase() + text.slice(1))}${/[.!?]$/.test(text) ? "" : "."}`;
}
