#include "core/modes/hair_metric.hpp"

#include <algorithm>

#include "core/levels/ffd_matrix.hpp"
#include "core/levels/hair_sample.hpp"

namespace hairnet {
namespace {

// About how many points of the hair are sampled.
constexpr std::size_t kPoints = 6000;
// The weight of each node by itself, as a share of the mean weight of a node. It is enough to make G positive definite
// where nodes have no hair, and too little to show at the other nodes.
constexpr double kAlone = 1e-3;

}  // namespace

Eigen::MatrixXf hair_metric(const Groom& groom, const Level& level) {
  const HairSample hair = sample_hair(groom, kPoints);
  const Eigen::SparseMatrix<double> ffd = ffd_matrix(level, hair.points, hair.blend);
  const auto count = ffd.cols();
  // G = F^T F over the number of points, with F the FFD of sampled points.
  Eigen::MatrixXd metric =
      Eigen::MatrixXd(Eigen::SparseMatrix<double>(ffd.transpose() * ffd)) / static_cast<double>(hair.points.size());
  // Hair of no length does not move at all.
  const double alone = std::max(kAlone * metric.trace() / static_cast<double>(count), 1e-6);
  metric.diagonal().array() += alone;
  return metric.cast<float>();
}

}  // namespace hairnet
