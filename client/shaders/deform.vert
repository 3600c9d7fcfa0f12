#include "scene.glsl"
#include "character.glsl"
#include "skin_push.glsl"
#include "ffd.glsl"

// Points of a groom as the other shaders move them, for reading back.
layout(location = 0) in vec4 rest;
layout(location = 1) in vec4 direction;

out vec3 position_head;
out vec3 tangent_head;

void main() {
  HairPoint point = deform(load_character(first_record), rest, direction);
  position_head = point.position;
  tangent_head = point.tangent;
  gl_Position = kNowhere;
}
