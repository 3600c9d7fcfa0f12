#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "core/levels/level.hpp"

// Checks that are valid for a level of any groom.
namespace hairnet::support {

template <class T>
bool all_finite(const std::vector<T>& values) {
  return std::ranges::all_of(values, [](const T& v) { return std::isfinite(v); });
}

// The weights of a spring add up to 0, those of an attachment to 1 (`weight_sum`).
inline void expect_valid(const Stiffeners& stiffeners, std::size_t node_count, float weight_sum, const Level& level) {
  ASSERT_EQ(stiffeners.begin.size(), stiffeners.count() + 1);
  ASSERT_EQ(stiffeners.nodes.size(), stiffeners.weights.size());
  EXPECT_EQ(stiffeners.begin.back(), stiffeners.nodes.size());
  EXPECT_EQ(stiffeners.damping.size(), stiffeners.count());
  EXPECT_EQ(stiffeners.rest.size(), stiffeners.count());
  EXPECT_TRUE(all_finite(stiffeners.weights) && all_finite(stiffeners.stiffness) && all_finite(stiffeners.damping));
  for (std::size_t s = 0; s < stiffeners.count(); ++s) {
    EXPECT_GT(stiffeners.stiffness[s], 0);
    float sum = 0;
    Vec3f rest = Vec3f::Zero();
    for (std::uint32_t e = stiffeners.begin[s]; e < stiffeners.begin[s + 1]; ++e) {
      ASSERT_LT(stiffeners.nodes[e], node_count);
      if (e > stiffeners.begin[s]) {
        EXPECT_LT(stiffeners.nodes[e - 1], stiffeners.nodes[e]);
      }
      sum += stiffeners.weights[e];
      rest += stiffeners.weights[e] * level.rest[stiffeners.nodes[e]];
    }
    EXPECT_NEAR(sum, weight_sum, 1e-5f);
    EXPECT_NEAR((rest - stiffeners.rest[s]).norm(), 0, 1e-6f);
  }
}

inline void expect_valid(const Level& level) {
  EXPECT_EQ(validate(level.geometry), "");
  const std::size_t n = level.geometry.active_nodes.size();
  ASSERT_GT(n, 0u);
  ASSERT_EQ(level.rest.size(), n);
  ASSERT_EQ(level.mass.size(), n);
  ASSERT_EQ(level.ether_stiffness.size(), n);
  ASSERT_EQ(level.ether_damping.size(), n);
  ASSERT_EQ(level.drag.size(), n);
  for (std::size_t i = 0; i < n; ++i) {
    EXPECT_TRUE(level.rest[i].allFinite());
    EXPECT_TRUE(std::isfinite(level.mass[i]) && level.mass[i] > 0);
    EXPECT_TRUE(std::isfinite(level.ether_stiffness[i]) && level.ether_stiffness[i] > 0);
    const auto& [xx, xy, xz, yy, yz, zz] = level.drag[i];
    EXPECT_GE(xx, 0);
    // A drag matrix is positive semi-definite, or air would push forward; this checks one of its minors.
    EXPECT_GE(xx * yy - xy * xy, -1e-6f * xx * yy);
    EXPECT_TRUE(std::isfinite(xz) && std::isfinite(yz) && zz >= 0);
  }
  expect_valid(level.springs, n, 0, level);
  expect_valid(level.attachments, n, 1, level);
}

}  // namespace hairnet::support
