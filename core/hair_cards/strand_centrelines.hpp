#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "core/groom/groom.hpp"

namespace hairnet {

// The centreline of a strand: the strand without its curls, as local means at equal arc lengths from root to tip.
inline constexpr std::size_t kCentrelinePoints = 25, kOutlinePoints = 4;
struct Centreline {
  std::array<Vec3f, kCentrelinePoints> points;  // the first is the root, the last the tip
  std::array<Vec3f, kOutlinePoints> outline;    // the same, coarser: even long waves have disappeared
  float own_variance_m2 = 0;                    // of the strand about its centreline, per axis across it: the curls
  float root_length_m = 0;
  std::uint16_t group = 0;
  bool rooted = true;
};

// Makes the centrelines of all strands, then those of the cards' middle lines. Lines without length are left out.
// Asserts that the strands of clumps exist.
std::vector<Centreline> make_centrelines(const Groom& groom);

// The length of the polyline through the outline's points, m.
float outline_length(const std::array<Vec3f, kOutlinePoints>& outline);
// Reduces a line that is already smooth to an outline.
std::array<Vec3f, kOutlinePoints> make_outline(const std::array<Vec3f, kCentrelinePoints>& line);

}  // namespace hairnet
