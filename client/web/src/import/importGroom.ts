import { Instance } from "../module/instance";

const kFileBytes = 12;
const kOptionsBytes = 32;

/** What is known of the files; all else is guessed. Errors and remarks name these as flags of `hairnet-groom import`. */
export interface ImportOptions {
  /** the hairstyle's; by default that of the first file, without its extension */
  readonly name?: string;
  /** the files' axis upwards: "+x", "-x", "+y", … */
  readonly up?: string;
  /** the one out of the face */
  readonly face?: string;
  /** which point of a strand is its root */
  readonly roots?: "first" | "last";
  /** metres in a unit of the files */
  readonly unitM?: number;
}

export interface ImportedHair {
  /** the bytes of a .groom file */
  readonly groom: Uint8Array<ArrayBuffer>;
  /** What was guessed, skipped and counted, a line each; the first says how the hair was taken to lie. */
  readonly remarks: readonly string[];
}

/** What `importHair` asks of a worker. */
export interface ImportWork {
  readonly module: WebAssembly.Module;
  readonly files: readonly { readonly name: string; readonly bytes: Uint8Array }[];
  readonly options: ImportOptions;
}

/** Makes a hairstyle of the files of one head. The thread stands still for up to some seconds. */
export async function importGroom({ module, files, options }: ImportWork): Promise<ImportedHair> {
  // Of its own: the memory that files and groom take is gone with it.
  const instance = await Instance.of(module);
  const list = new DataView(new ArrayBuffer(kFileBytes * files.length));
  for (const [i, { name, bytes }] of files.entries()) {
    const file = [instance.name(name), instance.put(bytes), bytes.length];
    for (const [field, value] of file.entries()) list.setUint32(kFileBytes * i + 4 * field, value, true);
  }
  const known = new DataView(new ArrayBuffer(kOptionsBytes));
  known.setUint32(0, kOptionsBytes, true);
  for (const [i, text] of [options.name, options.up, options.face, options.roots].entries())
    if (text !== undefined) known.setUint32(4 + 4 * i, instance.name(text), true);
  known.setFloat64(24, options.unitM ?? 0, true);
  const groom = instance.with(new Uint8Array(list.buffer), (filesAt) =>
    instance.with(new Uint8Array(known.buffer), (optionsAt) =>
      instance.made("", "hairnet_groom_import", filesAt, files.length, optionsAt),
    ),
  );
  const remarks = instance.text(instance.call("hairnet_groom_remarks", groom));
  return { groom: instance.allBytes("hairnet_groom_file", groom), remarks: remarks.split("\n").slice(0, -1) };
}
