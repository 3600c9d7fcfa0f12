#pragma once

#include <cmath>
#include <memory>

#include "client/link/known_basis.hpp"

namespace hairnet::link {

// The nodes of small_basis(), and the coordinates of their displacements.
inline constexpr std::size_t kSmallBasisNodes = 27, kSmallBasisCoordinates = 3 * kSmallBasisNodes;

// Makes a basis over 3 x 3 x 3 nodes, whose modes are waves. The deviation of mode k is 0.1 m / (1 + k).
inline wire::HairBasis small_basis(int mode_count = 12) {
  wire::HairBasis hair;
  hair.geometry.lattice.dims = {3, 3, 3};
  for (std::uint32_t node = 0; node < kSmallBasisNodes; ++node) hair.geometry.active_nodes.push_back(node);
  hair.geometry.trimmed_begin = {0};
  hair.basis.node_count = kSmallBasisNodes;
  for (int mode = 0; mode < mode_count; ++mode) {
    hair.basis.deviation_m.push_back(0.1f / static_cast<float>(1 + mode));
    hair.basis.unit.push_back(1e-3f);
    // The numbers of a mode are in units of 1 mm (`unit`).
    for (std::size_t i = 0; i < kSmallBasisCoordinates; ++i) {
      const double wave = std::sin(0.1 * (mode + 1) * static_cast<double>(i));
      hair.basis.modes.push_back(static_cast<std::int16_t>(std::lround(1000 * wave)));
    }
  }
  // A skin of one cube of 1 cm about the neck, 5 mm away everywhere, so that tests see whether the skin arrives.
  hair.skin.push_back({Bone::neck, Vec3f::Zero(), 0.01f, {2, 2, 2}, std::vector<float>(8, 0.005f)});
  return hair;
}

}  // namespace hairnet::link
