import { kImportMiBMax } from "../generated/constants";
import { checkOptions } from "../hair/checkOptions";
import { HairnetError, messageOf } from "../module/hairnetError";
import { inWorker } from "../module/inWorker";
import { ModuleFile, readFile } from "../module/moduleFile";
import { importGroom, type ImportedHair, type ImportOptions, type ImportWork } from "./importGroom";
import ImportWorker from "./importWorker?worker&inline";

/** A `File`, or what has these parts of one. */
export interface HairFile {
  /** Its extension tells the format: "curls.abc". */
  readonly name: string;
  /** The count of its bytes. */
  readonly size?: number;
  arrayBuffer(): Promise<ArrayBuffer>;
}

const importFile = new ModuleFile(() =>
  readFile(new URL("./hairnet_import.wasm", import.meta.url), "or let a bundler that knows new URL() copy it"),
);
/** A value of each option's type, for `checkOptions`. */
const kUnknown = { name: "", up: "", face: "", roots: "first", unitM: 0 } as const;

/**
 * Makes a hairstyle of the files of one head that other programs have written (.abc, .usd, .hair, .tfx, .ply, .npz, …),
 * as `hairnet-groom import` does; one without strands among them is the body that they were made on. Works in a worker,
 * or on this thread where no worker can run. Rejects with a one-line `HairnetError`.
 */
export async function importHair(given: Iterable<HairFile>, options: ImportOptions = {}): Promise<ImportedHair> {
  checkOptions(options, kUnknown, "importHair");
  const files = filesOf(given);
  if (files.reduce((sum, { size = 0 }) => sum + size, 0) > kImportMiBMax * 2 ** 20)
    throw new HairnetError("invalid", `the files have more than ${kImportMiBMax} MiB in all`);
  const [module, ...read] = await Promise.all([importFile.compiled(), ...files.map(readHair)]);
  const work: ImportWork = { module, files: read, options };
  return inWorker(ImportWorker, work, () => importGroom(work));
}

function filesOf(given: unknown): HairFile[] {
  const isFile = (file: unknown): file is HairFile =>
    typeof (file as HairFile | null)?.name === "string" && typeof (file as HairFile).arrayBuffer === "function";
  const files =
    typeof given === "object" && given && Symbol.iterator in given ? [...(given as Iterable<unknown>)] : null;
  if (!files?.every(isFile))
    throw new HairnetError(
      "invalid",
      "importHair: give files, as those of <input type=file> or of a drop, in an array",
    );
  return files;
}

async function readHair(file: HairFile): Promise<ImportWork["files"][number]> {
  try {
    return { name: file.name, bytes: new Uint8Array(await file.arrayBuffer()) };
  } catch (thrown) {
    // It was moved or changed after it was chosen.
    const error = messageOf(thrown);
    throw new HairnetError("invalid", `${file.name.replace(/\p{C}/gu, "\ufffd")} cannot be read: ${error}`);
  }
}
