import { HairnetError } from "../hair/hairnetError";
import accumulateFrag from "../../../shaders/accumulate.frag?raw";
import bodyFrag from "../../../shaders/body.frag?raw";
import bodyVert from "../../../shaders/body.vert?raw";
import character from "../../../shaders/character.glsl?raw";
import coverage from "../../../shaders/coverage.glsl?raw";
import deformPointsFrag from "../../../shaders/deform_points.frag?raw";
import density from "../../../shaders/density.glsl?raw";
import densityPointsVert from "../../../shaders/density_points.vert?raw";
import densityPointsFrag from "../../../shaders/density_points.frag?raw";
import densityLightVert from "../../../shaders/density_light.vert?raw";
import densityLightFrag from "../../../shaders/density_light.frag?raw";
import fabricFrag from "../../../shaders/fabric.frag?raw";
import fabricVert from "../../../shaders/fabric.vert?raw";
import ffd from "../../../shaders/ffd.glsl?raw";
import hairLight from "../../../shaders/hair_light.glsl?raw";
import limitLengthsFrag from "../../../shaders/limit_lengths.frag?raw";
import modeNodesFrag from "../../../shaders/mode_nodes.frag?raw";
import nodesVert from "../../../shaders/nodes.vert?raw";
import presentFrag from "../../../shaders/present.frag?raw";
import pointsVert from "../../../shaders/points.vert?raw";
import scene from "../../../shaders/scene.glsl?raw";
import screenVert from "../../../shaders/screen.vert?raw";
import shadowFrag from "../../../shaders/shadow.frag?raw";
import skinPush from "../../../shaders/skin_push.glsl?raw";
import strandFrag from "../../../shaders/strand.frag?raw";
import strandVert from "../../../shaders/strand.vert?raw";
import strandPoints from "../../../shaders/strand_points.glsl?raw";
import uploadedNodesFrag from "../../../shaders/uploaded_nodes.frag?raw";
import cardFrag from "../../../shaders/card.frag?raw";
import cardTextureFrag from "../../../shaders/card_texture.frag?raw";
import cardVert from "../../../shaders/card.vert?raw";

const files: Record<string, string> = {
  "accumulate.frag": accumulateFrag,
  "body.frag": bodyFrag,
  "body.vert": bodyVert,
  "character.glsl": character,
  "coverage.glsl": coverage,
  "deform_points.frag": deformPointsFrag,
  "density.glsl": density,
  "density_points.vert": densityPointsVert,
  "density_points.frag": densityPointsFrag,
  "density_light.vert": densityLightVert,
  "density_light.frag": densityLightFrag,
  "fabric.frag": fabricFrag,
  "fabric.vert": fabricVert,
  "ffd.glsl": ffd,
  "hair_light.glsl": hairLight,
  "limit_lengths.frag": limitLengthsFrag,
  "mode_nodes.frag": modeNodesFrag,
  "nodes.vert": nodesVert,
  "points.vert": pointsVert,
  "present.frag": presentFrag,
  "scene.glsl": scene,
  "screen.vert": screenVert,
  "shadow.frag": shadowFrag,
  "skin_push.glsl": skinPush,
  "strand.frag": strandFrag,
  "strand.vert": strandVert,
  "strand_points.glsl": strandPoints,
  "uploaded_nodes.frag": uploadedNodesFrag,
  "card.frag": cardFrag,
  "card_texture.frag": cardTextureFrag,
  "card.vert": cardVert,
};

/**
 * A shader of client/shaders with its `#include "file"` lines resolved, each file once, and without its `#version`,
 * which three.js writes. Throws when it, or what it includes, does not exist.
 */
export function shader(name: string): string {
  return withIncludes(fileOf(name));
}

/** The same of another shader's text. */
export function withIncludes(text: string): string {
  return resolve(text, new Set())
    .replace(/^#version.*$/gm, "")
    .trimStart();
}

function resolve(text: string, included: Set<string>): string {
  return text.replace(/^#include "([^"]+)"$/gm, (_, name: string) => {
    if (included.has(name)) return "";
    included.add(name);
    return resolve(fileOf(name), included);
  });
}

function fileOf(name: string): string {
  const text = files[name];
  if (text === undefined) throw new HairnetError("invalid", `there is no shader ${name}`);
  return text;
}
