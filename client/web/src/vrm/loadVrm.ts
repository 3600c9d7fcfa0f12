import { VRMLoaderPlugin, VRMUtils, type VRM } from "@pixiv/three-vrm";
import { GLTFLoader } from "three/addons/loaders/GLTFLoader.js";
import { HairnetError, messageOf } from "../module/hairnetError";

/** The largest file that `loadVrm` reads. */
export const kVrmBytesMax = 128 * 1024 * 1024;
/** All arrays of a model together have at most this many numbers: a small file can claim arrays of any length. */
const kVrmNumbersMax = 64 * 1024 * 1024;

// A binary glTF file begins with "glTF", its version and its size. Then come the size and the kind ("JSON") of its
// first chunk, each in 4 bytes, little endian.
const kMagic = 0x46546c67;
const kJsonChunk = 0x4e4f534a;
const kHeaderBytes = 20;

/**
 * Loads a VRM model of version 0.x or 1.0 from the bytes of its file; it looks along +Z. Throws `HairnetError` when the
 * bytes are not such a model.
 */
export async function loadVrm(file: ArrayBuffer | Uint8Array): Promise<VRM> {
  const bytes = file instanceof Uint8Array ? file : new Uint8Array(file);
  validateVrm(bytes);
  const loader = new GLTFLoader().register((parser) => new VRMLoaderPlugin(parser));
  let vrm: VRM | undefined;
  try {
    vrm = (await loader.parseAsync(bytes.slice().buffer, "")).userData.vrm;
  } catch (error) {
    throw new HairnetError("malformed", `the VRM file is damaged: ${firstLine(error)}`);
  }
  if (!vrm)
    throw new HairnetError("malformed", "the VRM file is damaged: its skeleton is missing or of no known version");
  VRMUtils.rotateVRM0(vrm);
  return vrm;
}

interface GltfJson {
  extensions?: Record<string, unknown>;
  buffers?: { uri?: unknown }[];
  images?: { uri?: unknown }[];
  accessors?: { count?: unknown; type?: unknown }[];
}

function validateVrm(bytes: Uint8Array): void {
  if (bytes.length > kVrmBytesMax) {
    const most = kVrmBytesMax / 1024 / 1024;
    throw new HairnetError("too_large", `the file has ${mebibytes(bytes.length)} MB; a VRM file may have ${most} MB`);
  }
  const view = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
  if (bytes.length < kHeaderBytes || view.getUint32(0, true) !== kMagic)
    throw new HairnetError("malformed", `this is not a VRM file: ${whatElse(bytes)}`);
  if (view.getUint32(4, true) !== 2)
    throw new HairnetError("malformed", "this is glTF of an old version; a VRM file contains glTF 2.0");
  const jsonBytes = view.getUint32(12, true);
  if (view.getUint32(8, true) > bytes.length || kHeaderBytes + jsonBytes > bytes.length)
    throw new HairnetError("malformed", "the VRM file is cut off: its end is missing. Download or export it again");
  if (view.getUint32(16, true) !== kJsonChunk)
    throw new HairnetError("malformed", "the VRM file is damaged: its description is missing");
  let json: GltfJson | null;
  try {
    const text = new TextDecoder("utf-8", { fatal: true }).decode(
      bytes.subarray(kHeaderBytes, kHeaderBytes + jsonBytes),
    );
    json = JSON.parse(text);
  } catch {
    throw new HairnetError("malformed", "the VRM file is damaged: its description cannot be read");
  }
  const { extensions } = json ?? {};
  if (!extensions || typeof extensions !== "object" || !("VRM" in extensions || "VRMC_vrm" in extensions))
    throw new HairnetError(
      "invalid",
      "this is a glTF model without VRM data, so its bones are not known. Export it as VRM, for example with the VRM add-on for Blender or with UniVRM",
    );
  const links = [...list(json?.buffers), ...list(json?.images)].map((entry) => entry?.uri);
  if (links.some((uri) => typeof uri === "string" && !uri.startsWith("data:")))
    throw new HairnetError("invalid", "the VRM file needs other files beside it. Export it as one file");
  let numbers = 0;
  for (const accessor of list(json?.accessors)) {
    const count = accessor?.count;
    if (typeof count !== "number" || !Number.isInteger(count) || count < 0)
      throw new HairnetError("malformed", "the VRM file is damaged: an array has no valid length");
    numbers += count * (kNumbersOf[String(accessor?.type)] ?? 16);
  }
  if (numbers > kVrmNumbersMax) throw new HairnetError("too_large", "the VRM model has too many vertices");
}

/** The count of numbers in an element of an array, by the type that glTF names. Unknown types count as the largest. */
const kNumbersOf: Record<string, number> = { SCALAR: 1, VEC2: 2, VEC3: 3, VEC4: 4, MAT2: 4, MAT3: 9, MAT4: 16 };

function list<T>(entries: T[] | undefined): (T | null)[] {
  return Array.isArray(entries) ? entries : [];
}

function whatElse(bytes: Uint8Array): string {
  const start = new TextDecoder("latin1").decode(bytes.subarray(0, 64)).trimStart();
  if (bytes.length === 0) return "it is empty";
  if (start.startsWith("{")) return "it looks like a text of glTF or JSON. A VRM file is one binary file";
  if (start.startsWith("PK")) return "it is an archive. Unpack it first, and choose the .vrm file in it";
  if (start.startsWith("<")) return "it is a web page or XML. Download the model itself";
  if (/^[\t\n\r -~]*$/.test(start)) return "it is a text";
  return "its first bytes are unknown";
}

function mebibytes(bytes: number): number {
  return Math.ceil(bytes / 1024 / 1024);
}

function firstLine(error: unknown): string {
  const text = messageOf(error);
  return text.replace(/^THREE\.GLTFLoader: /, "").split("\n")[0];
}
