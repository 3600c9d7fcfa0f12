#pragma once

#include <cmath>
#include <memory>

#include "client/link/known_basis.hpp"

namespace hairnet::link {

// Makes a basis over 3 x 3 x 3 nodes, whose modes are waves. The deviation of mode k is 0.1 m / (1 + k).
inline wire::HairBasis small_basis(int mode_count = 12) {
  wire::HairBasis hair;
  hair.geometry.lattice.dims = {3, 3, 3};
  for (std::uint32_t node = 0; node < 27; ++node) hair.geometry.active_nodes.push_back(node);
  hair.geometry.trimmed_begin = {0};
  hair.basis.node_count = 27;
  for (int mode = 0; mode < mode_count; ++mode) {
    hair.basis.deviation_m.push_back(0.1f / static_cast<float>(1 + mode));
    hair.basis.unit.push_back(1e-3f);
    for (int i = 0; i < 81; ++i)
      hair.basis.modes.push_back(static_cast<std::int16_t>(std::lround(1000 * std::sin(0.1 * (mode + 1) * i))));
  }
  hair.skin.push_back({Bone::neck, Vec3f::Zero(), 0.01f, {2, 2, 2}, std::vector<float>(8, 0.005f)});
  return hair;
}

}  // namespace hairnet::link
