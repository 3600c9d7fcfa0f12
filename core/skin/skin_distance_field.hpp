#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "core/geometry/vec.hpp"
#include "core/pose/pose.hpp"

namespace hairnet {

// The skin that follows one bone: the signed distance to it (negative inside) on a grid, in head space at rest. The
// paper sums metaballs instead (3.3); the force law is still the metaballs' (core/solver/contact.hpp). It is rigid:
// skin that stretches between two bones is in the fields of both.
struct SkinDistanceField {
  Bone bone = Bone::head;
  // The position of node (0, 0, 0), m.
  Vec3f origin = Vec3f::Zero();
  // The distance between two neighbouring nodes, m.
  float cell_m = 0;
  // The number of nodes along each axis, at least 2.
  std::array<int, 3> dims{0, 0, 0};
  // The distance of each node to the skin, m, negative inside. Node (i, j, k) has index i + nx (j + ny k).
  std::vector<float> distance;
};
// The skin of a body: at most one field a bone.
using Skin = std::vector<SkinDistanceField>;

// The signed distance at a point (head space at rest, m): trilinear inside the grid; outside it, the value at the
// nearest point of the grid plus the distance to that point. `gradient` may be null; its length is about 1.
// Asserts that the field has cells.
double skin_distance(const SkinDistanceField& field, const Vec3& point, Vec3* gradient = nullptr);

// Clients know each distance as a byte: in steps, and only near the skin. Farther away it is the nearest that a byte
// says. The reach matters more than the step: after the push 0.02 % of a dance's points are too deep, and 1.22 % with
// -48 mm and steps of 0.25 mm.
inline constexpr float kSkinStep_m = 0.35e-3f;
// Byte 0 means this distance, and byte 255 means 15.75 mm outside.
inline constexpr float kSkinDeepest_m = -0.0735f;
std::uint8_t skin_byte(float distance_m);
inline float distance_of_skin_byte(std::uint8_t byte) {
  return kSkinDeepest_m + kSkinStep_m * static_cast<float>(byte);
}

// The most nodes of one grid, so that those of all bones fit into a texture.
inline constexpr int kSkinNodesMax = 262'144;
inline constexpr float kSkinCellMin_m = 1e-4f;
// The greatest size of a number that validate() accepts; far larger than any built value.
inline constexpr float kSkinNumberMax = 1e9f;
// Returns an empty string when valid (a field a bone at most, counts agree, numbers within bounds); else one line.
std::string validate(const Skin& skin);

}  // namespace hairnet
