#include "scene.glsl"
#include "character.glsl"
#include "density.glsl"

// The skinned body: each bone moves it by its share (linear blend).
layout(location = 0) in vec3 rest;     // head space
layout(location = 1) in vec4 normal;   // at rest; share of scalp, 0 ... 1
layout(location = 2) in vec4 sides;    // transmittance from +x -x +y -y, through hair and body
layout(location = 3) in vec4 ends;     // from +z -z; share of the fifth bone; 0
layout(location = 4) in vec4 shares;   // of the bones: head, neck, left and right shoulder

out vec3 position_scene;
out vec3 normal_scene;
out vec4 light_sides;
out vec2 light_ends;
out vec4 light_changes;
out float roots;
flat out int row;

// The camera looks out of this head: its inside would hide everything.
bool is_in_head(vec3 camera, int row, float size) {
  vec3 head = rotate_back(record(row, 0), camera - record(row, 1).xyz) / size;
  return length(head - vec3(0.0, 0.09, 0.02)) < 0.1;
}

void main() {
  row = first_record + gl_InstanceID;
  float share[kBoneCount] = float[kBoneCount](shares.x, shares.y, shares.z, shares.w, ends.z);
  float total = 0.0, size = 1.0 + record(row, 4).w;
  position_scene = normal_scene = vec3(0.0);
  for (int b = 0; b < kBoneCount; ++b) {
    vec4 rotation = record(row, 6 + 2 * b);
    position_scene += share[b] * (rotate(rotation, size * rest) + record(row, 7 + 2 * b).xyz);
    normal_scene += share[b] * rotate(rotation, normal.xyz);
    total += share[b];
  }
  position_scene /= max(total, 1e-3);
  normal_scene *= sign(size);
  light_sides = sides;
  light_ends = ends.xy;
  light_changes = light_change(row, rest, rotate_back(record(row, 0), position_scene - record(row, 1).xyz) / size);
  roots = normal.w;
  bool is_inside = shares.x > 0.5 && is_in_head(cameraPosition, row, size);
  gl_Position = record(row, 5).w > 0.5 || is_inside ? kNowhere : to_clip(position_scene);
}
