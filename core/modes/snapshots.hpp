#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <vector>

#include "core/groom/groom.hpp"
#include "core/levels/level.hpp"
#include "core/parallel_for.hpp"

namespace hairnet {

// How much motion a basis is learnt from, and how well it has to show motion that it was not learnt from.
struct ModeTraining {
  // The number of motions, at least two. Twice as many lessen the error of 64 modes by only 3 %.
  std::uint32_t motion_count = 24;
  // The duration of each motion, s.
  double duration_s = 5;
  // The time between two snapshots, s.
  double snapshot_s = 0.1;
  // The error of all modes, over the motion, that is wanted. It may be larger only when kModeCountMax modes err by
  // more.
  float error_max = 0.065f;
};

// The displacements of all levels in the same motions, at the same moments. A column is a snapshot: x of all active
// nodes, then y, then z; head space, m.
struct Snapshots {
  std::array<Eigen::MatrixXf, 4> levels;
  // The number of the motion from which each column comes.
  std::vector<std::uint32_t> motion;
};

// Steps all levels through the training motions. Empty when `keep_going`, which gets the finished share, returns false.
Snapshots take_snapshots(const Groom& groom, const std::shared_ptr<const LevelSet>& levels,
                         const ModeTraining& training, const std::function<bool(double)>& keep_going,
                         const ParallelFor& parallel_for);

// Shows the same snapshots as [node][snapshot and axis], for products with matrices over nodes.
inline Eigen::Map<Eigen::MatrixXf> by_node(Eigen::MatrixXf& columns) {
  return {columns.data(), columns.rows() / 3, 3 * columns.cols()};
}

}  // namespace hairnet
