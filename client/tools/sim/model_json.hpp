#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "core/gravity.hpp"
#include "core/levels/level.hpp"
#include "core/solver/step.hpp"

namespace hairnet::sim {

// What of a run the dump says. The level must outlive the call.
struct ModelDump {
  const Level* level = nullptr;
  double rate_hz = 30;
  int substep_count = 1;
  // The acceleration of gravity, m/s^2, world.
  Vec3 gravity{0, -kGravity_m_per_s2, 0};
  // The steady wind, world.
  Vec3 wind_m_per_s = Vec3::Zero();
  // Rows of --out whose step was a teleport, ascending.
  std::vector<std::size_t> resets;
};

// Encodes a built model as JSON (README.md explains each field), so that a program that shares no code with this one
// can integrate it. Every number reads back to the same bits. `level` must not be null. It holds no gusts and
// turbulence: --dump-model refuses them.
std::string encode_model_json(const ModelDump& dump);

}  // namespace hairnet::sim
