import type { HairFile } from "../src/import/index";
import { Groom, HairnetError, type Member } from "../src/index";
import { foreignFileWords, messageOf } from "./errorWords";
import { isolated } from "./isolated";
import { hairstyleName } from "./roomDetails";

/** A hairstyle that the user can choose. */
export interface Hairstyle {
  readonly label: string;
  /** Gets the files of the hairstyle, or a member of the room who has this hair. */
  readonly get: () => Promise<HairFiles | Member>;
}

/** The bytes of a hairstyle's files. */
export interface HairFiles {
  readonly groom: Uint8Array;
  /** The .levels file, for a browser that simulates the hair itself; absent where there is none beside the groom. */
  readonly levels?: Uint8Array;
}

/**
 * The hairstyles beside the page. `grooms/index.json` lists file names, or objects {name, file}; a missing list is no
 * error. `withLevels`: the files of their levels are wanted, too.
 */
export async function listedHairstyles(withLevels: boolean): Promise<Hairstyle[]> {
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
    const label = typeof name === "string" ? isolated(name) : hairstyleName(file.replace(/\.groom$/, ""));
    return [{ label, get: () => listedFiles(`grooms/${file}`, withLevels) }];
  });
}

async function listedFiles(address: string, withLevels: boolean): Promise<HairFiles> {
  // A page without the file of levels builds them itself.
  const noLevels = () => undefined;
  const levels = withLevels ? download(address.replace(/groom$/, "levels")).catch(noLevels) : undefined;
  return { groom: await download(address), levels: await levels };
}

async function download(address: string): Promise<Uint8Array> {
  const answer = await fetch(address).catch(() => null);
  if (!answer) throw new HairnetError("unreachable", "The server does not answer: the hairstyle could not be loaded.");
  if (!answer.ok)
    throw new HairnetError("unreachable", `The server does not have the hairstyle ${address} (HTTP ${answer.status}).`);
  return new Uint8Array(await answer.arrayBuffer());
}

/** The grooms of a room's members, each once. */
export function roomHairstyles(members: Iterable<Member>): Hairstyle[] {
  const byGroom = new Map<string, Member>();
  for (const member of members) if (member.groom && !byGroom.has(member.groomKey)) byGroom.set(member.groomKey, member);
  return [...byGroom.values()].map((member) => ({
    label: `${hairstyleName(member.groom?.name ?? "")} (in the room)`,
    get: () => Promise.resolve(member),
  }));
}

/** The hairstyle of files, and what was guessed and skipped to make it, a line each. */
export interface FileHairstyle {
  readonly style: Hairstyle;
  readonly remarks: readonly string[];
}

/**
 * Makes a hairstyle of the files that the user chose or dropped: a .groom file, or the files of one head that another
 * program has written. Throws a one-line `HairnetError` when they make no hairstyle.
 */
export async function fileHairstyle(files: readonly HairFile[]): Promise<FileHairstyle> {
  const whole = files.find(({ name }) => /\.groom$/i.test(name));
  if (whole && files.length > 1)
    throw new HairnetError("invalid", `${isolated(whole.name)} is a whole hairstyle: give it without other files.`);
  return whole ? { style: await wholeHairstyle(whole), remarks: [] } : importedHairstyle(files);
}

async function wholeHairstyle(file: HairFile): Promise<Hairstyle> {
  const bytes = new Uint8Array(await file.arrayBuffer());
  try {
    return await styleOf(bytes, file.name);
  } catch (thrown) {
    const error = messageOf(thrown);
    throw new HairnetError("malformed", `${isolated(file.name)} is no whole hairstyle file: ${error}`);
  }
}

async function importedHairstyle(files: readonly HairFile[]): Promise<FileHairstyle> {
  // Most visitors give no such file: its code is not a part of the first download.
  const { importHair } = await import("../src/import/index");
  try {
    const { groom, remarks } = await importHair(files);
    return { style: await styleOf(groom, files[0].name), remarks };
  } catch (error) {
    if (!(error instanceof HairnetError)) throw error;
    const names = files.map(({ name }) => name);
    throw new HairnetError(error.code, foreignFileWords(names, error.message));
  }
}

async function styleOf(groom: Uint8Array, fileName: string): Promise<Hairstyle> {
  const { name } = await Groom.load(groom);
  return { label: hairstyleName(name || fileName), get: () => Promise.resolve({ groom }) };
}
