import { HairnetError } from "../module/hairnetError";

const kFolder = "../../../shaders/";
/** The texts of all shaders, by path, without those that only the desktop's viewer has. */
const files = import.meta.glob<string>(
  [
    "../../../shaders/*.{glsl,vert,frag}",
    "!../../../shaders/{background,deform,depths,nothing,overlay,resolve}.{vert,frag}",
  ],
  { query: "?raw", import: "default", eager: true },
);

/**
 * A shader of client/shaders with its `#include "file"` lines resolved, each file once, and without its `#version`,
 * which three.js writes. Throws when it, or what it includes, does not exist.
 */
export function shader(name: string): string {
  return resolve(name, new Set())
    .replace(/^#version.*$/gm, "")
    .trimStart();
}

function resolve(name: string, included: Set<string>): string {
  const text = files[kFolder + name];
  if (text === undefined) throw new HairnetError("invalid", `there is no shader ${name}`);
  return text.replace(/^#include "([^"]+)"$/gm, (_, other: string) => {
    if (included.has(other)) return "";
    included.add(other);
    return resolve(other, included);
  });
}
