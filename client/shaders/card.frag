#include "scene.glsl"
#include "character.glsl"
#include "hair_light.glsl"
#include "coverage.glsl"

in vec3 position_scene;
in vec3 tangent_scene;
in vec3 normal_scene;
in vec4 light_sides;
in vec2 light_ends;
in vec4 light_changes;
in vec3 place;
flat in int row;

uniform sampler2D card_texture;  // red: shade of a hair; green: its random number; blue: glint; alpha: coverage

out vec4 colour;

void main() {
  Character character = load_character(row);
  // The texture has four ribbons side by side, mirrored or not, so that neighbours differ.
  float number = floor(place.z + 0.5);
  float across = mod(floor(number / 4.0), 2.0) > 0.5 ? 1.0 - place.x : place.x;
  vec4 hair = texture(card_texture, vec2((mod(number, 4.0) + mix(0.004, 0.996, across)) / 4.0, place.y));
  float drawn = dithered(hair.a, place.z, 0.3);
  if (drawn <= 0.0) discard;
  vec4 chance = vec4(hair.x, 0.5, hair.y, hair.z);
  character.hair_albedo = albedo_along(character, place.y);
  roughness = record(row, kTipTexel).w;
  vec3 albedo = hair_albedo(character.hair_albedo, chance, place.y);
  vec3 sum = shade_hair(position_scene, normalize(tangent_scene), character.rotation, character.size, albedo, chance, light_sides, light_ends, light_changes);
  // A card represents hairs around it: its edges turn away from the viewer.
  float facing = 0.75 + 0.25 * abs(dot(normalize(normal_scene), normalize(cameraPosition - position_scene)));
  colour = vec4(to_target_through_fog(sum * facing, position_scene), drawn);
}
