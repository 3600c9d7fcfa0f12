#pragma once

#include <cmath>
#include <span>

#include "core/learnt/learnt_hair.hpp"
#include "core/random.hpp"

namespace hairnet::support {

// Makes a network with random weights, which has learnt nothing: it moves, forgets within a second as learnt ones do,
// and comes to rest.
inline LearntHair random_learnt_hair(std::uint64_t seed, std::size_t hidden_count = 20, std::size_t mode_count = 12) {
  Random random(seed);
  LearntHair hair;
  hair.hidden_count = hidden_count;
  hair.mode_count = mode_count;
  const auto fill = [&](std::vector<float>& weights, std::size_t count, double size) {
    for (std::size_t i = 0; i < count; ++i) weights.push_back(static_cast<float>(size * random.bell()));
  };
  fill(hair.input_weights, 3 * hidden_count * kPoseInputCount, 0.3);
  fill(hair.hidden_weights, 3 * hidden_count * hidden_count, 0.3);
  fill(hair.bias, 3 * hidden_count, 1);
  // A positive z0 lets each hidden number follow its target quickly, so that the network forgets.
  for (float& z0 : std::span(hair.bias).first(hidden_count)) z0 = 1 + std::abs(z0);
  fill(hair.output_weights, mode_count * hidden_count, 0.02);
  // Inputs up to 10, and air up to 15 m/s, count as covered by training.
  hair.most.fill(10);
  fill(hair.wind.weights, 3 * hidden_count * kAirInputCount, 0.05);
  hair.wind.max_m_per_s = 15;
  return hair;
}

}  // namespace hairnet::support
