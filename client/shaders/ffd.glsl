// Free-form deformation by a character's lattice (core/ffd has the same in C++; reference_deform.cpp is the easiest to
// read). u(x) = sum over nodes of w(x) * displacement, head space, m; `slope` is its gradient, column a = du / dx_a.
// Outside the lattice its border nodes extrapolate linearly. `weight`: of quadratic or linear FFD in their mixture.

uniform highp usampler2D lattices;  // displacements of nodes, head space, m: the bits of three floats

vec3 node_displacement(int node) {
  return uintBitsToFloat(texelFetch(lattices, ivec2(node & (kLatticeRow - 1), node / kLatticeRow), 0).xyz);
}

void add_quadratic(vec3 g, ivec3 dims, int first, float weight, vec3 inverse_spacing, inout vec3 u, inout mat3 slope) {
  vec3 middle = clamp(floor(g + 0.5), vec3(1.0), vec3(dims - 2));
  vec3 t = g - middle;
  vec3 low = step(t, vec3(-0.5)), high = step(vec3(0.5), t), within = 1.0 - low - high;
  vec3 a = 0.5 - t, b = 0.5 + t;
  vec3 w[3], d[3];
  w[0] = within * (0.5 * a * a) - low * t;
  w[1] = within * (0.75 - t * t) + low * (1.0 + t) + high * (1.0 - t);
  w[2] = within * (0.5 * b * b) + high * t;
  d[0] = (within * -a - low) * inverse_spacing;
  d[1] = (within * (-2.0 * t) + low - high) * inverse_spacing;
  d[2] = (within * b + high) * inverse_spacing;
  ivec3 lowest = ivec3(middle) - 1;
  for (int k = 0; k < 3; ++k) {
    for (int j = 0; j < 3; ++j) {
      int node = first + lowest.x + dims.x * (lowest.y + j + dims.y * (lowest.z + k));
      vec3 p0 = node_displacement(node), p1 = node_displacement(node + 1), p2 = node_displacement(node + 2);
      vec3 row = w[0].x * p0 + w[1].x * p1 + w[2].x * p2;
      float wy = weight * w[j].y, wz = w[k].z;
      u += wy * wz * row;
      slope[0] += wy * wz * (d[0].x * p0 + d[1].x * p1 + d[2].x * p2);
      slope[1] += weight * d[j].y * wz * row;
      slope[2] += wy * d[k].z * row;
    }
  }
}

void add_linear(vec3 g, ivec3 dims, int first, float weight, vec3 inverse_spacing, inout vec3 u, inout mat3 slope) {
  vec3 lowest = clamp(floor(g), vec3(0.0), vec3(dims - 2));
  vec3 t = g - lowest;
  ivec3 at = ivec3(lowest);
  for (int k = 0; k < 2; ++k) {
    for (int j = 0; j < 2; ++j) {
      int node = first + at.x + dims.x * (at.y + j + dims.y * (at.z + k));
      vec3 p0 = node_displacement(node), p1 = node_displacement(node + 1);
      vec3 row = mix(p0, p1, t.x);
      float wy = weight * (j == 0 ? 1.0 - t.y : t.y), wz = k == 0 ? 1.0 - t.z : t.z;
      float dy = weight * (j == 0 ? -1.0 : 1.0) * inverse_spacing.y, dz = (k == 0 ? -1.0 : 1.0) * inverse_spacing.z;
      u += wy * wz * row;
      slope[0] += wy * wz * inverse_spacing.x * (p1 - p0);
      slope[1] += dy * wz * row;
      slope[2] += wy * dz * row;
    }
  }
}

void displace(Character character, vec3 x, out vec3 u, out mat3 slope) {
  u = vec3(0.0);
  slope = mat3(0.0);
  if (!character.is_moved) return;
  vec4 spacing = record(character.row, kLatticeTexel + 1);
  ivec3 dims = ivec3(record(character.row, kLatticeTexel + 2).xyz);
  vec3 g = (x - record(character.row, kLatticeTexel).xyz) * spacing.xyz;
  float quadratic = character.quadratic, linear = 1.0 - quadratic;
  if (quadratic != 0.0) add_quadratic(g, dims, int(spacing.w), quadratic, spacing.xyz, u, slope);
  if (linear != 0.0) add_linear(g, dims, int(spacing.w), linear, spacing.xyz, u, slope);
}

// A groom's point after the FFD and the push out of the skin, head space.
struct HairPoint {
  vec3 position;
  // Of the FFD alone, along s, the arc length at rest: t + delta J t + (d delta / ds) u; not of unit length.
  vec3 tangent;
  mat3 frame;    // transforms small things at the point: 1 + delta J
};

// `rest`: position and delta of eq. 7; `direction`: rest tangent and d delta / ds, 1/m.
HairPoint deform(Character character, vec4 rest, vec4 direction) {
  vec3 u;
  mat3 slope;
  displace(character, rest.xyz, u, slope);
  mat3 frame = mat3(1.0) + rest.w * slope;
  return HairPoint(push_out(character, rest, rest.xyz + rest.w * u), frame * direction.xyz + direction.w * u, frame);
}
