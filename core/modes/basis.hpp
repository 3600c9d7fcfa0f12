#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "core/geometry/vec.hpp"

namespace hairnet {

// The most modes of a basis.
inline constexpr std::size_t kModeCountMax = 256;

// The shapes in which the hair of one groom moves, the most important first. The displacements of the active nodes of
// the finest level are
//
//     d = sum_k c_k m_k.
//
// The modes m_k are orthonormal in the hair: the mean square of the displacements of the hair's points is sum_k c_k^2.
// A coefficient is therefore a distance in metres, an error of a coefficient is an equal error of the hair on the mean,
// and the first n coefficients are the best n. Immutable; sent to clients.
struct Basis {
  // The number of active nodes of the finest level.
  std::size_t node_count = 0;
  // The RMS of each coefficient over the training motions, m, in descending order.
  std::vector<float> deviation_m;
  // What an integer of 1 stands for in each mode; without dimension.
  std::vector<float> unit;
  // The integers of all modes, [mode][active node][x, y, z], in axes of the head.
  std::vector<std::int16_t> modes;

  [[nodiscard]] std::size_t mode_count() const { return deviation_m.size(); }
};

// Returns an empty string when counts agree, all numbers are finite and deviations are positive and do not ascend; else
// one line about the error.
std::string validate(const Basis& basis);

// d from the first coefficients (m); the others are 0. Asserts that there are not more than modes, and that `out` (head
// space, m) has one entry a node.
void displacements_of(const Basis& basis, std::span<const float> coefficients, std::span<Vec3f> out);

}  // namespace hairnet
