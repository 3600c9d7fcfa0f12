/** hairnet-client/import: hairstyles of the files of other programs. */
export { importHair, type HairFile } from "./importHair";
export type { ImportedHair, ImportOptions } from "./importGroom";
