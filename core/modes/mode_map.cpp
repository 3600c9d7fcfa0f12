#include "core/modes/mode_map.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>

#include "core/assert.hpp"

namespace hairnet {
namespace {

// The displacements of so many nodes, of all characters, stay in the nearest cache while all rows of the matrix use
// them.
constexpr std::size_t kNodesAtOnce = 32;
// Fewer characters than this are faster one by one, because the kernel always computes kModeMapWidth.
constexpr std::size_t kWorthwhile = 4;

}  // namespace

void ModeMap::coefficients_of(std::span<const Vec3f> displacements, std::span<float> out) const {
  HAIRNET_ASSERT(static_cast<Eigen::Index>(3 * displacements.size()) == matrix_.cols());
  HAIRNET_ASSERT(static_cast<Eigen::Index>(out.size()) <= matrix_.rows());
  const auto count = static_cast<Eigen::Index>(out.size());
  Eigen::Map<Eigen::VectorXf>(out.data(), count).noalias() =
      matrix_.topRows(count) * Eigen::Map<const Eigen::VectorXf>(displacements.data()->data(), matrix_.cols());
}

void ModeMap::coefficients_of(std::span<const std::span<const Vec3f>> displacements,
                              std::span<const std::span<float>> out) const {
  HAIRNET_ASSERT(displacements.size() == out.size());
  HAIRNET_ASSERT(displacements.size() <= kModeMapWidth);
  if (displacements.size() < kWorthwhile) {
    for (std::size_t i = 0; i < out.size(); ++i) coefficients_of(displacements[i], out[i]);
    return;
  }
  const std::size_t rows = out.front().size(), nodes = displacements.front().size();
  HAIRNET_ASSERT(static_cast<Eigen::Index>(rows) <= matrix_.rows());
  HAIRNET_ASSERT(rows <= kModeCountMax);
  HAIRNET_ASSERT(static_cast<Eigen::Index>(3 * nodes) == matrix_.cols());
  HAIRNET_ASSERT(std::ranges::all_of(displacements, [&](const auto& one) { return one.size() == nodes; }));
  HAIRNET_ASSERT(std::ranges::all_of(out, [&](const auto& one) { return one.size() == rows; }));
  // [number][character]
  alignas(64) std::array<float, 3 * kNodesAtOnce * kModeMapWidth> numbers{};
  alignas(64) std::array<float, kModeCountMax * kModeMapWidth> sums;
  std::fill_n(sums.begin(), rows * kModeMapWidth, 0.0f);
  // Characters' displacements are turned into lanes part by part, while the part stays in the nearest cache.
  for (std::size_t first = 0; first < nodes; first += kNodesAtOnce) {
    const std::size_t count = std::min(kNodesAtOnce, nodes - first);
    for (std::size_t i = 0; i < displacements.size(); ++i) {
      const float* const from = displacements[i][first].data();
      for (std::size_t k = 0; k < 3 * count; ++k) numbers[k * kModeMapWidth + i] = from[k];
    }
    mode_map_kernel(matrix_.data() + 3 * first, 3 * nodes, rows, 3 * count, numbers.data(), sums.data());
  }
  for (std::size_t i = 0; i < out.size(); ++i)
    for (std::size_t k = 0; k < rows; ++k) out[i][k] = sums[k * kModeMapWidth + i];
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
  // Rounded modes are only nearly orthonormal, hence the solution instead of the transpose.
  return ModeMap(products.llt().solve(weighted));
}

}  // namespace hairnet
