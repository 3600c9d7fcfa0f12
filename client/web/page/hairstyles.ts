import { decodeGroom, type Member } from "../src/index";

/** A hairstyle that the user can choose. */
export interface Hairstyle {
  readonly label: string;
  /** its file; or a member with this hair */
  readonly get: () => Promise<Uint8Array | Member>;
}

/** Files beside the page: `grooms/index.json` is a list of names, or of {name, file}; a missing list is no error. */
export async function listedHairstyles(): Promise<Hairstyle[]> {
  let listed: unknown;
  try {
    const answer = await fetch("grooms/index.json");
    if (!answer.ok) return [];
    listed = await answer.json();
  } catch {
    return [];
  }
  if (!Array.isArray(listed)) return [];
  return listed.flatMap((entry: unknown) => {
    const file = typeof entry === "string" ? entry : (entry as { file?: unknown } | null)?.file;
    if (typeof file !== "string" || !/^[\w.-]+\.groom$/.test(file)) return [];
    const name = (entry as { name?: unknown }).name;
    const label = typeof name === "string" ? name : file.replace(/\.groom$/, "");
    return [{ label, get: () => download(`grooms/${file}`) }];
  });
}

async function download(address: string): Promise<Uint8Array> {
  const answer = await fetch(address);
  if (!answer.ok) throw new Error(`${address} is not there (${answer.status})`);
  return new Uint8Array(await answer.arrayBuffer());
}

/** Each groom of the room once. */
export function roomHairstyles(members: Iterable<Member>): Hairstyle[] {
  const byGroom = new Map<string, Member>();
  for (const member of members) if (member.groom && !byGroom.has(member.groomKey)) byGroom.set(member.groomKey, member);
  return [...byGroom.values()].map((member) => ({
    label: `${member.groom?.name || "hairstyle"} (in the room)`,
    get: () => Promise.resolve(member),
  }));
}

/** A file that the user chose or dropped. Throws a one-line `HairnetError` when it is not a groom. */
export async function fileHairstyle(file: File): Promise<Hairstyle> {
  const bytes = new Uint8Array(await file.arrayBuffer());
  const groom = decodeGroom(bytes);
  return { label: groom.name || file.name, get: () => Promise.resolve(bytes) };
}
