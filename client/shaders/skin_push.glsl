// Pushes hair out of the skin: core/ffd/skin_push.hpp explains it, and reference_skin_push.cpp is the easiest to read.
// Nothing is pushed where the groom's skin is not known: no bone has a grid.
uniform highp sampler2D skin_nodes;        // distance, way (0: far around); node n is at texel n mod kSkinRow, n / kSkinRow
uniform highp vec4 skin_place[kBoneCount];  // of the bone's grid: origin, m, in its rest space; cell, m; 0: it has none
uniform highp vec4 skin_dims[kBoneCount];   // nodes an axis; number of the first node
uniform highp float skin_thickness;        // of the hair, m

const int kSkinRow = 1024;
const float kSkinDeepest = -0.0735, kSkinStep = 0.35e-3;  // m; of a byte
const float kSkinWaySteps = 89.0;
const float kSkinSlack = 1e-5;
const float kSkinFullBlend = 0.25;

// Nodes are fetched and weighed here: devices interpolate filtered texels in 256 steps, so hair at rest would move.
vec4 skin_node(int node) {
  return texelFetch(skin_nodes, ivec2(node & (kSkinRow - 1), node / kSkinRow), 0);
}

vec4 skin_nodes_along_x(int node, float t) { return mix(skin_node(node), skin_node(node + 1), t); }

// The distance, m, and the way. Too far from the grid for any limit: only that it is far.
vec4 skin_at(int bone, vec3 point) {
  vec4 place = skin_place[bone], dims = skin_dims[bone];
  vec3 at = (point - place.xyz) / place.w;
  vec3 within = clamp(at, vec3(0.0), dims.xyz - 1.0);
  float beyond = place.w * distance(at, within);
  if (beyond >= skin_thickness - kSkinDeepest) return vec4(skin_thickness + kSkinSlack, vec3(0.0));
  vec3 low = min(floor(within), dims.xyz - 2.0), t = within - low;
  ivec3 n = ivec3(low);
  int row = int(dims.x), layer = row * int(dims.y), first = int(dims.w) + n.x + row * n.y + layer * n.z;
  vec4 lowest = skin_node(first);
  if (lowest.y == 0.0) return vec4(skin_thickness + kSkinSlack, vec3(0.0));
  vec4 node = mix(mix(mix(lowest, skin_node(first + 1), t.x), skin_nodes_along_x(first + row, t.x), t.y),
                  mix(skin_nodes_along_x(first + layer, t.x), skin_nodes_along_x(first + layer + row, t.x), t.y), t.z);
  node *= 255.0;
  return vec4(kSkinDeepest + kSkinStep * node.x + beyond, (node.yzw - 128.0) / kSkinWaySteps);
}

// `rest`: position and delta of eq. 7; `point`: after the FFD, head space.
vec3 push_out(Character character, vec4 rest, vec3 point) {
  for (int turn = 0; turn < 2; ++turn) {
    bool is_moved = false;
    for (int bone = 0; bone < kBoneCount; ++bone) {
      if (skin_place[bone].w <= 0.0) continue;
      vec4 rotation = record(character.row, 6 + 2 * bone);
      vec3 at = point;
      if (bone > 0) {
        vec3 shift = (character.position - record(character.row, 7 + 2 * bone).xyz) / character.size;
        at = rotate_back(rotation, rotate(character.rotation, point) + shift);
      }
      vec4 now = skin_at(bone, at);
      if (now.x >= skin_thickness) continue;
      float missing = min(skin_thickness, skin_at(bone, rest.xyz).x - kSkinSlack) - now.x;
      if (missing <= 0.0) continue;
      vec3 by = missing * now.yzw;
      if (bone > 0) by = min(rest.w / kSkinFullBlend, 1.0) * rotate_back(character.rotation, rotate(rotation, by));
      point += by;
      is_moved = true;
    }
    if (!is_moved) return point;
  }
  return point;
}
