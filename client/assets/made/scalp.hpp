#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "core/geometry/vec.hpp"

namespace hairnet::made {

// A place on the scalp from which a strand grows. Head space, m. The normal is that of the skin, of unit length.
struct Root {
  Vec3 point = Vec3::Zero();
  Vec3 normal = Vec3::UnitY();
  // The angle about the vertical axis, radians: 0 in front, pi behind, positive on the left (+X).
  double azimuth = 0;
  // From 0 at the nape to 1 at the crown.
  double height = 0;
};

// The distance of a point of the head above the hairline, m; negative on face, ears and neck.
double above_hairline(const Vec3& p);

// `count` roots spread evenly (a low-discrepancy sequence shifted by the seed) over the part of the scalp where `keep`
// returns true; over all of it when `keep` is empty. Fewer than `count` are returned where the kept part is too small
// to find. Every beginning of the list is spread evenly as well, so a part of it serves as a thinner hairstyle.
std::vector<Root> scatter_roots(std::size_t count, std::uint64_t seed,
                                const std::function<bool(const Vec3&)>& keep = {});

}  // namespace hairnet::made
