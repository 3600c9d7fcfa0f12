// Hairstyles for tests, made by hairnet_local.wasm, which deploy/wasm builds beside hairnet.wasm.
import { readFileSync } from "node:fs";
import { resolve } from "node:path";
import { Groom } from "../../src/hair/groom";
import { Instance } from "../../src/module/instance";
import { hairModule } from "../../src/module/moduleFile";
import type { GroomGeometry } from "../../src/scene/geometry/groomGeometry";
import { readGeometry } from "../../src/scene/geometry/readGeometry";
import { madeStrands } from "./madeGroom";

const kModule = process.env.HAIRNET_WASM ?? resolve(__dirname, "../../../../build/wasm/hairnet.wasm");

let instance: Promise<Instance> | null = null;

/** A module with all functions of client/hairnet.h, also those that make hairstyles and worlds. All tests share it. */
export function localModule(): Promise<Instance> {
  const file = kModule.replace(/\.wasm$/, "_local.wasm");
  instance ??= WebAssembly.compile(readFileSync(file)).then((module) => Instance.of(module));
  return instance;
}

/** The file of one of the built-in hairstyles, such as "long_curly". */
export async function styleFile(hairstyle: string, strands: number): Promise<Uint8Array<ArrayBuffer>> {
  const module = await localModule();
  return takeFile(module, (out) => module.check("", "hairnet_groom_make", module.name(hairstyle), strands, out));
}

/** The .groom file of `madeStrands`, with the body of the default person. `shape`: the arguments of `madeStrands`. */
export async function strandsFile(...shape: Parameters<typeof madeStrands>): Promise<Uint8Array<ArrayBuffer>> {
  const module = await localModule();
  const { points, counts } = madeStrands(...shape);
  return module.with(new Uint8Array(points.buffer), (xyz) =>
    module.with(new Uint8Array(counts.buffer), (each) =>
      takeFile(module, (out) => module.check("", "hairnet_groom_from_strands", 0, xyz, each, counts.length, 0, 0, out)),
    ),
  );
}

/** The groom of `strandsFile`, loaded by the page's own module. */
export async function someGroom(...shape: Parameters<typeof madeStrands>): Promise<Groom> {
  return Groom.load(await strandsFile(...shape));
}

/** What `GroomBuilder` makes of a .groom file: the whole geometry, and not the coarse one. */
export async function geometryOf(file: Uint8Array): Promise<GroomGeometry> {
  const module = await Instance.of(await hairModule());
  return readGeometry(module, module.makeOf("hairnet_groom_load", file), false)!;
}

// `make` writes the handle of a new groom to the place that it gets. hairnet_groom_file is called twice: first it tells
// the size of the file, then it fills a buffer of that size.
function takeFile(module: Instance, make: (out: number) => void): Uint8Array<ArrayBuffer> {
  return module.with(new Uint8Array(4), (at) => {
    make(at);
    const groom = module.u32(at);
    module.view().setUint32(at, 0, true);
    module.call("hairnet_groom_file", groom, 0, at);
    const size = module.u32(at);
    return module.with(new Uint8Array(size), (buffer) => {
      module.call("hairnet_groom_file", groom, buffer, at);
      module.call("hairnet_groom_free", groom);
      return module.copy(buffer, size) as Uint8Array<ArrayBuffer>;
    });
  });
}
