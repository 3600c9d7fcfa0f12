import { Instance } from "../module/instance";

/** The sizes of hairnet_file and hairnet_import_options of client/hairnet.h, where addresses have 4 bytes. */
const kFileBytes = 12;
const kOptionsBytes = 32;

/**
 * What is known of the files; all else is guessed. Errors and remarks name these as flags of `hairnet-groom import`.
 */
export interface ImportOptions {
  /** The name of the hairstyle; by default it is that of the first file, without its extension. */
  readonly name?: string;
  /** The axis of the files that points upwards: "+x", "-x", "+y", … */
  readonly up?: string;
  /** The axis of the files that points out of the face. */
  readonly face?: string;
  /** Which point of a strand is its root. */
  readonly roots?: "first" | "last";
  /** How many metres a unit of the files has. */
  readonly unitM?: number;
}

export interface ImportedHair {
  /** The bytes of a .groom file. */
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
  // The import has an instance of its own, so that the memory which files and groom take is freed with the instance.
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
