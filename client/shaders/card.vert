#include "scene.glsl"
#include "character.glsl"
#include "skin_push.glsl"
#include "ffd.glsl"
#include "hair_light.glsl"
#include "density.glsl"

// Cards: ribbons of textured hair.
layout(location = 0) in vec4 rest;       // head space; delta
layout(location = 1) in vec4 direction;  // rest tangent, root to tip; d delta / ds
layout(location = 2) in vec4 sides;      // transmittance from +x -x +y -y
layout(location = 3) in vec4 ends;       // from +z -z; along: 0 at the root ... 1; across: 0 left, 1 right
layout(location = 4) in vec4 side;       // unit, from left to right at rest; number of the card

out vec3 position_scene;
out vec3 tangent_scene;
out vec3 normal_scene;
out vec4 light_sides;
out vec2 light_ends;
out vec4 light_changes;
out vec3 place;  // across, along, number of the card
flat out int row;

void main() {
  Character character = load_character(first_record + gl_InstanceID);
  row = character.row;
  HairPoint point = deform(character, rest, direction);
  position_scene = to_scene(character, point.position);
  tangent_scene = to_scene_axes(character.rotation, character.size, normalize(point.tangent + vec3(0.0, -1e-6, 0.0)));
  normal_scene = normalize(cross(rotate(character.rotation, point.frame * side.xyz), tangent_scene) + vec3(0.0, 1e-6, 0.0));
  light_sides = sides;
  light_ends = ends.xy;
  light_changes = light_change(character.row, rest.xyz, point.position);
  place = vec3(ends.w, ends.z, side.w);
  gl_Position = to_clip(position_scene);
}
