#pragma once

#include <cstdint>
#include <span>
#include <unordered_map>

#include "core/hair_cards/strand_centrelines.hpp"

namespace hairnet {

// A coarse voxel grid of the hair. It gives the direction from a point towards the surface of the hair.
class HairVolume {
 public:
  explicit HairVolume(std::span<const Centreline> centrelines);

  // Points away from the surrounding hair: (point - mean of the hair within kReach) / kReach. Its length is about 0.5
  // at the surface, at most 1, and 0 inside evenly distributed hair or where there is none. Asserts that the point is
  // finite.
  [[nodiscard]] Vec3 towards_surface(const Vec3& point) const;

 private:
  static constexpr double kReach = 0.04, kCube = 0.5 * kReach;  // m
  struct Hair {
    Vec3 sum = Vec3::Zero();
    double count = 0;
  };
  std::unordered_map<std::uint64_t, Hair> cubes_;
};

}  // namespace hairnet
