#include "scene.glsl"
#include "character.glsl"
#include "skin_push.glsl"
#include "ffd.glsl"
#include "strand_points.glsl"

// The first of two passes over the points of strands: FFD, and the push out of the skin.
flat in int row;
uniform highp sampler2D rest_points;  // of the groom: head space, m; delta
out uvec4 point;

// The rotation of the frame, without its stretch and shear.
vec4 rotation_in(mat3 frame) {
  vec3 x = normalize(frame[0] + vec3(1e-6, 0.0, 0.0));
  vec3 z = normalize(cross(x, frame[1]) + vec3(0.0, 0.0, 1e-6));
  vec3 y = cross(z, x);
  float trace = x.x + y.y + z.z;
  if (trace > 0.0) return vec4(y.z - z.y, z.x - x.z, x.y - y.x, 1.0 + trace);
  if (x.x > y.y && x.x > z.z) return vec4(1.0 + x.x - y.y - z.z, x.y + y.x, x.z + z.x, y.z - z.y);
  if (y.y > z.z) return vec4(x.y + y.x, 1.0 + y.y - x.x - z.z, y.z + z.y, z.x - x.z);
  return vec4(x.z + z.x, y.z + z.y, 1.0 + z.z - x.x - y.y, x.y - y.x);
}

void main() {
  ivec2 at = ivec2(gl_FragCoord.xy) - ivec2(0, point_rows(row).x);
  vec4 rest = texelFetch(rest_points, at, 0);
  vec3 u;
  mat3 slope;
  Character character = load_character(row);
  displace(character, rest.xyz, u, slope);
  vec3 position = push_out(character, rest, rest.xyz + rest.w * u);
  point = texel_with(StrandPoint(position, rotation_in(mat3(1.0) + rest.w * slope)));
}
