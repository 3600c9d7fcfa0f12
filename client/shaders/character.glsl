// A character's record: row `row` of `records`, RGBA float, kRecordTexels wide.
//   0 head rotation, quaternion xyzw     1 head position xyz, scene space; first row of its strands' points
//   2 hair albedo at the root; width of a strand at its root, m
//   3 share of strands drawn; quadratic share of the FFD
//   4 follow hairs; how far they stray, m; 1 when a lattice moves the hair; size - 1
//   5 skin albedo; 1 when the body is not drawn
//   6 ... 15 bones: rotation, position; texel 7 also has the count of rows of its strands' points
//   9, 11, 13, 15 w: size of a cell of its grid of density, m; weight of its strands there
//   16 ... 18 lattice: origin, number of its basis in the picture, or 0: its nodes are uploaded, or -1: they are there
//   from the picture before; 1 / spacing, first node in `lattices`; nodes an axis, count of its coefficients or first
//   row of its uploaded nodes
//   19 hair albedo at the tip; roughness of the hair
//   20 origin of its grid of density, head space; number of the grid, from 1, or 0: it has none
//   21 ... 84 coefficients of its modes, m, four a texel
const int kRecordTexels = 85;
const int kBoneCount = 5;
const int kLatticeTexel = 16;
const int kTipTexel = 19;
const int kCoefficientTexel = 21;
const int kLatticeRow = 1024;  // texels of a row of `lattices`

uniform highp sampler2D records;
uniform int first_record;  // of this draw call
uniform int copies;        // instances a character

struct Character {
  vec4 rotation;
  vec3 position;
  vec3 hair_albedo;
  float width;
  float strand_share, quadratic;
  float follow_hairs, stray;
  float size;  // 1: the size of its groom; negative: mirrored in the head joint, which with a rotation is any mirror
  bool is_moved;
  int row;
};

vec4 record(int row, int texel) { return texelFetch(records, ivec2(texel, row), 0); }

// Rows of `lattices` that its nodes have.
int node_rows(int row) {
  ivec3 dims = ivec3(record(row, kLatticeTexel + 2).xyz);
  return (dims.x * dims.y * dims.z + kLatticeRow - 1) / kLatticeRow;
}

Character load_character(int row) {
  vec4 rotation = record(row, 0), position = record(row, 1), hair = record(row, 2), detail = record(row, 3),
       more = record(row, 4);
  return Character(rotation, position.xyz, hair.xyz, hair.w, detail.x, detail.y, more.x, more.y, 1.0 + more.w, more.z > 0.5, row);
}

// How the hair changes from its root (s 0) to its tip (s 1).
vec3 albedo_along(Character character, float s) {
  return mix(character.hair_albedo, record(character.row, kTipTexel).xyz, s);
}

vec3 to_scene(Character character, vec3 head) {
  return rotate(character.rotation, character.size * head) + character.position;
}
