#include "scene.glsl"
#include "character.glsl"
#include "strand_points.glsl"
#include "hair_light.glsl"
#include "density.glsl"

// A strand as a ribbon that faces the camera, through points that two earlier passes have placed (deform_points.frag,
// limit_lengths.frag). Every point has two vertices: even ones on the left, odd ones on the right. Shading is done for
// each vertex, not for each pixel: a ribbon is a pixel or two wide, and its points are close together. Instances: a
// character's strands, then its follow hairs, then the next character.
layout(location = 0) in vec4 sides;  // transmittance from +x -x +y -y
layout(location = 1) in vec4 ends;   // from +z -z; fraction of the strand's length; 0
layout(location = 2) in float strand;

uniform highp usampler2D placed_points;
uniform highp sampler2D rest_points;  // of the groom: head space, m; delta

uniform float strand_count;

out vec4 shade;   // colour in the target's encoding; coverage of the core
out vec3 across;  // px from the middle; half of the drawn width, px; the strand's random number

// Follow hairs are furthest from their strand in the middle; at the tips they gather into locks.
vec3 follow_hair_offset(vec4 chance, float s, float stray) {
  float reach = stray * mix(0.55, 1.0, smoothstep(0.0, 0.25, s)) * mix(1.0, 0.7, smoothstep(0.5, 1.0, s));
  float turn = 6.2832 * (chance.x + (chance.z - 0.5) * s);
  float z = 2.0 * chance.y - 1.0;
  return reach * vec3(sqrt(1.0 - z * z) * vec2(cos(turn), sin(turn)), z).xzy * sqrt(chance.w);
}

// Strands are in random order, so the first of them are an even sample; the last ones of the share fade in.
float presence(float share) {
  float rank = (strand + 0.5) / strand_count;
  return share >= 1.0 ? 1.0 : clamp((share - rank) / (0.15 * share + 1e-6), 0.0, 1.0);
}

void main() {
  Character character = load_character(first_record + gl_InstanceID / copies);
  int copy = gl_InstanceID % copies;
  float present = presence(character.strand_share) * clamp(character.follow_hairs + 1.0 - float(copy), 0.0, 1.0);
  shade = vec4(0.0);
  across = vec3(0.0);
  gl_Position = kNowhere;
  if (present <= 0.0) return;

  float s = ends.z;
  character.hair_albedo = albedo_along(character, s);
  roughness = record(character.row, kTipTexel).w;
  vec4 chance = random4(uint(strand) * 16u + uint(copy));
  int number = gl_VertexID >> 1, first_row = point_rows(character.row).x;
  uvec4 point = texelFetch(placed_points, texel_of(number, first_row), 0);
  vec3 head = position_of(point);
  vec3 before = s > 0.0 ? position_of(texelFetch(placed_points, texel_of(number - 1, first_row), 0)) : head;
  vec3 after = s < 1.0 ? position_of(texelFetch(placed_points, texel_of(number + 1, first_row), 0)) : head;
  vec3 t = to_scene_axes(character.rotation, character.size, normalize(after - before + vec3(0.0, -1e-9, 0.0)));
  if (copy > 0) head += rotate(rotation_of(point), follow_hair_offset(chance, s, character.stray));
  vec3 position = to_scene(character, head);

#ifdef SHADOW
  // A shadow map has no follow hairs: each strand is as wide as they and the strand together.
  vec3 colour = vec3(0.0);
  float widened = 1.0 + 0.8 * character.follow_hairs;
#else
  vec4 change = light_change(character.row, texelFetch(rest_points, texel_of(number, 0), 0).xyz, position_of(point));
  vec3 colour = shade_hair(position, t, character.rotation, character.size, hair_albedo(character.hair_albedo, chance, s), chance, sides, ends.xy, change);
  colour = to_target_through_fog(colour, position);
  float widened = 1.0;
#endif

  vec4 clip = to_clip(position), ahead = to_clip(position + t * 1e-3);
  vec2 pixel = 0.5 * viewport_px;
  vec2 along = (ahead.xy * clip.w - clip.xy * ahead.w) * pixel;
  along = dot(along, along) > 1e-20 ? normalize(along) : vec2(1.0, 0.0);
  bool left = (gl_VertexID & 1) == 0;
  vec2 side = vec2(-along.y, along.x) * (left ? -1.0 : 1.0);

  // Tips end at random lengths, softly.
  float end = 1.0 - 0.12 * chance.z;
  float taper = mix(1.0, 0.45, s * s) * (1.0 - smoothstep(end - 0.12, end, s));
  float width_px = character.width * widened * taper * (copy == 0 ? 1.0 : 0.8) * px_per_m() / max(clip.w, 1e-3);
  float least_px = 1.0 / samples;  // wider ribbons of less coverage blur, and their coverage has more grain
  float half_px = 0.5 * max(width_px, least_px);
  float edge_px = half_px + (samples < 2.0 ? 0.5 : 0.0);  // several samples already make soft edges
  clip.xy += side * edge_px / pixel * clip.w;
  gl_Position = clip;
  shade = vec4(colour, min(width_px / least_px, 1.0) * present);
  across = vec3(left ? -edge_px : edge_px, half_px, chance.y);
}
