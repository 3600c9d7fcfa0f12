#include "core/modes/mode_map.hpp"

#include <Eigen/Cholesky>

#include "core/assert.hpp"

namespace hairnet {

void ModeMap::coefficients_of(std::span<const Vec3f> displacements, std::span<float> out) const {
  HAIRNET_ASSERT(static_cast<Eigen::Index>(3 * displacements.size()) == matrix_.cols());
  HAIRNET_ASSERT(static_cast<Eigen::Index>(out.size()) <= matrix_.rows());
  const auto count = static_cast<Eigen::Index>(out.size());
  Eigen::Map<Eigen::VectorXf>(out.data(), count).noalias() =
      matrix_.topRows(count) * Eigen::Map<const Eigen::VectorXf>(displacements.data()->data(), matrix_.cols());
}

ModeMap make_projection(const Basis& basis, const Eigen::MatrixXf& metric) {
  using Stride = Eigen::Stride<Eigen::Dynamic, Eigen::Dynamic>;
  using Integers = Eigen::Matrix<std::int16_t, Eigen::Dynamic, Eigen::Dynamic>;
  const auto nodes = static_cast<Eigen::Index>(basis.node_count), count = static_cast<Eigen::Index>(basis.mode_count());
  HAIRNET_ASSERT(metric.rows() == nodes);
  HAIRNET_ASSERT(metric.cols() == nodes);
  const auto units = Eigen::Map<const Eigen::VectorXf>(basis.unit.data(), count).asDiagonal();
  Eigen::MatrixXf weighted(count, 3 * nodes), products = Eigen::MatrixXf::Zero(count, count);
  for (Eigen::Index axis = 0; axis < 3; ++axis) {
    const Eigen::Map<const Integers, 0, Stride> integers(basis.modes.data() + axis, nodes, count, Stride(3 * nodes, 3));
    const Eigen::MatrixXf modes = integers.cast<float>() * units;
    const Eigen::MatrixXf rows = (metric * modes).transpose();
    products += rows * modes;
    Eigen::Map<Eigen::MatrixXf, 0, Stride>(weighted.data() + axis * count, count, nodes, Stride(3 * count, 1)) = rows;
  }
  return ModeMap(products.llt().solve(weighted));
}

}  // namespace hairnet
