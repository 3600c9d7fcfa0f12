#include "scene.glsl"
#include "character.glsl"
#include "skin_push.glsl"
#include "ffd.glsl"

// Cloth and threads in the hair. A thread is a ribbon that faces the camera, lit as a round cord.
layout(location = 0) in vec4 rest;       // head space; delta
layout(location = 1) in vec4 direction;  // cloth: rest normal; thread: rest tangent; d delta / ds
layout(location = 2) in vec4 sides;      // transmittance from +x -x +y -y
layout(location = 3) in vec4 ends;       // from +z -z; 0; 0
layout(location = 4) in vec4 albedo;     // linear RGB; opacity
layout(location = 5) in float cord;      // half of a thread's width, m, negative on its left; 0: cloth

out vec3 position_scene;
out vec3 normal_scene;
out vec3 cord_side;  // for a thread: to its right, scene, times the position across (-1 ... 1); 0 on cloth
out vec4 light_sides;
out vec2 light_ends;
out vec4 albedo_opacity;
flat out vec4 rotation;
flat out float size;

void main() {
  Character character = load_character(first_record + gl_InstanceID);
  HairPoint point = deform(character, rest, direction);
  position_scene = to_scene(character, point.position);
  cord_side = vec3(0.0);
  if (cord == 0.0) {
    mat3 m = point.frame;
    normal_scene = rotate(character.rotation, mat3(cross(m[1], m[2]), cross(m[2], m[0]), cross(m[0], m[1])) * direction.xyz);
  } else {
    vec3 t = rotate(character.rotation, point.tangent);
    vec3 to_eye = normalize(cameraPosition - position_scene);
    vec3 right = normalize(cross(t, to_eye) + 1e-6);
    normal_scene = normalize(cross(right, t) + 1e-6);
    // At least a pixel wide.
    float clip_w = max(to_clip(position_scene).w, 1e-3);
    position_scene += sign(cord) * max(abs(cord * character.size), 0.5 * clip_w / px_per_m()) * right;
    cord_side = sign(cord) * right;
  }
  light_sides = sides;
  light_ends = ends.xy;
  albedo_opacity = albedo;
  rotation = character.rotation;
  size = character.size;
  gl_Position = to_clip(position_scene);
}
