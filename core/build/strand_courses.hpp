#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "core/groom/groom.hpp"

namespace hairnet {

// Where a strand goes, without its curls: means over pieces of it, spaced evenly by arc length from root to tip.
inline constexpr std::size_t kCoursePoints = 25, kOutlinePoints = 4;
struct Course {
  std::array<Vec3f, kCoursePoints> points;    // the first is the root, the last the tip
  std::array<Vec3f, kOutlinePoints> outline;  // the same, coarser: even long waves are gone
  float own_variance_m2 = 0;                  // of the strand's hair about its course, each way across: curls, locks
  float root_length_m = 0;
  std::uint16_t group = 0;
  bool rooted = true;
};

// Of all strands, then of the middles of all strips. What has no length has no course.
std::vector<Course> make_courses(const Groom& groom);

// Through its points, m.
float outline_length(const std::array<Vec3f, kOutlinePoints>& outline);
// Of a line that is a course itself.
std::array<Vec3f, kOutlinePoints> make_outline(const std::array<Vec3f, kCoursePoints>& line);

}  // namespace hairnet
