// The layout of the points of strands, in rows of kPointRow texels: point n of a groom is at texel n mod 1024 of row n
// / 1024, counted from the character's first row. A texel contains a position in head space, m, as the bits of three
// floats, and a rotation, the quaternion xyzw in bytes, which turns small things at the point.
const int kPointRow = 1024;

struct StrandPoint {
  vec3 position;
  vec4 rotation;
};

ivec2 texel_of(int point, int first_row) { return ivec2(point & (kPointRow - 1), first_row + point / kPointRow); }

// First row and count of rows of the character's points.
ivec2 point_rows(int row) { return ivec2(record(row, 1).w, record(row, 7).w); }

uvec4 texel_with(StrandPoint point) {
  uvec4 bytes = uvec4(round(normalize(point.rotation) * 127.0) + 128.0);
  return uvec4(floatBitsToUint(point.position), bytes.x | bytes.y << 8 | bytes.z << 16 | bytes.w << 24);
}

vec3 position_of(uvec4 texel) { return uintBitsToFloat(texel.xyz); }

vec4 rotation_of(uvec4 texel) {
  return (vec4((uvec4(texel.w) >> uvec4(0, 8, 16, 24)) & 255u) - 128.0) / 127.0;
}
