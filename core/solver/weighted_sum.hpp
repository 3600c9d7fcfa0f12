#pragma once

#include <vector>

#include "core/assert.hpp"
#include "core/levels/level.hpp"

// Eqs. 1-2 in double, for steps that are written to be read: the quantity that a stiffener acts on, and its force on
// the nodes.
namespace hairnet {

// epsilon = sum_j w_j p_j
inline Vec3 weighted_sum(const Stiffeners& s, std::size_t index, const std::vector<Vec3>& nodes) {
  HAIRNET_ASSERT(index < s.count());
  Vec3 sum = Vec3::Zero();
  for (std::uint32_t e = s.begin[index]; e < s.begin[index + 1]; ++e) sum += double{s.weights[e]} * nodes[s.nodes[e]];
  return sum;
}

// f_i += w_i sigma
inline void scatter(const Stiffeners& s, std::size_t index, const Vec3& sigma, std::vector<Vec3>& nodes) {
  HAIRNET_ASSERT(index < s.count());
  for (std::uint32_t e = s.begin[index]; e < s.begin[index + 1]; ++e) nodes[s.nodes[e]] += double{s.weights[e]} * sigma;
}

}  // namespace hairnet
