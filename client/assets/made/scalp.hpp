#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "core/geometry/vec.hpp"

namespace hairnet::made {

// A place on the scalp from which a strand grows. Head space, m.
struct Root {
  Vec3 point = Vec3::Zero();
  Vec3 normal = Vec3::UnitY();
  double azimuth = 0;  // about the vertical axis, radians: 0 in front, pi behind, + on the left (+X)
  double height = 0;   // 0 at the nape, 1 at the crown
};

// The distance of a point of the head above the hairline, m; negative on face, ears and neck.
double above_hairline(const Vec3& p);

// `count` roots spread evenly (a low-discrepancy sequence shifted by the seed) over the part of the scalp where `keep`
// returns true; over all of it when `keep` is empty.
std::vector<Root> scatter_roots(std::size_t count, std::uint64_t seed,
                                const std::function<bool(const Vec3&)>& keep = {});

}  // namespace hairnet::made
