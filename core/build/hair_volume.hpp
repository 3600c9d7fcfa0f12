#pragma once

#include <cstdint>
#include <span>
#include <unordered_map>

#include "core/build/strand_courses.hpp"

namespace hairnet {

// Where there is hair, in cubes: tells which way its surface is, in a tail as on the head.
class HairVolume {
 public:
  explicit HairVolume(std::span<const Course> courses);

  // Away from the hair around the point: the point less the mean of the hair within kReach, over kReach. About half at
  // a surface, 0 amid even hair and where there is none.
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
