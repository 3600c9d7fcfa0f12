#include "core/modes/make_modes.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <numeric>
#include <vector>

#include "core/assert.hpp"
#include "core/levels/level_map.hpp"
#include "core/modes/hair_metric.hpp"
#include "core/modes/leading_eigenvectors.hpp"

namespace hairnet {
namespace {

using Eigen::Index;
using Eigen::MatrixXf;
using Eigen::VectorXf;
using Factor = Eigen::LLT<MatrixXf>;

// The fewest modes of a basis, even for hair that hardly moves.
constexpr Index kModeCountMin = 32;

// The weight of each snapshot in the search for shapes: one over the square root of its motion's RMS. So lively motions
// count more, but not so much that hair which hardly moves counts for nothing.
VectorXf weights_of(const MatrixXf& columns, const Snapshots& snapshots) {
  // It is added to the RMS of a motion, so that hair which hardly moves has at most 1.4 times the weight of hair that
  // moves so much.
  constexpr float kCalm_m = 0.005f;
  VectorXf energy = VectorXf::Zero(snapshots.motion.back() + 1), count = energy;
  for (Index s = 0; s < columns.cols(); ++s) {
    const std::uint32_t motion = snapshots.motion[static_cast<std::size_t>(s)];
    energy[motion] += columns.col(s).squaredNorm();
    count[motion] += 1;
  }
  VectorXf weights(columns.cols());
  for (Index s = 0; s < weights.size(); ++s) {
    const std::uint32_t motion = snapshots.motion[static_cast<std::size_t>(s)];
    weights[s] = 1 / std::sqrt(std::sqrt(energy[motion] / count[motion]) + kCalm_m);
  }
  return weights;
}

// Appends a mode as integers of 16 bits. Where the coefficient is small they use fewer bits, which makes the file of
// the basis smaller.
void store_mode(const Eigen::Ref<const VectorXf>& mode, float deviation_m, Basis& basis) {
  // The unit is chosen so that rounding moves a node by about half of kError_m with a usual coefficient. kMax is the
  // largest integer of 16 bits.
  constexpr float kMax = 32767, kError_m = 3e-5f;
  const float finest = std::max(mode.cwiseAbs().maxCoeff(), 1e-20f) / kMax;
  const float unit = std::max(finest, std::min(kError_m / deviation_m, 0.03f));
  basis.unit.push_back(unit);
  const Index nodes = mode.size() / 3;
  for (Index node = 0; node < nodes; ++node)
    for (Index axis = 0; axis < 3; ++axis)
      basis.modes.push_back(static_cast<std::int16_t>(std::lround(mode[axis * nodes + node] / unit)));
}

// Shapes of the hair with the largest deviation first. They are orthonormal, as the columns are in which they were
// found (find_shapes).
struct Shapes {
  MatrixXf vectors;
  VectorXf deviation_m;
};

// Finds `count` shapes. `columns`: L^T d of the snapshots, where G = L L^T is the hair's metric, so that a column's
// length is the hair's distance. `near`: vectors to start from, or none.
Shapes find_shapes(const MatrixXf& columns, const VectorXf& weights, Index count, const MatrixXf& near,
                   const ParallelFor& parallel_for) {
  const MatrixXf found = leading_eigenvectors(columns * weights.asDiagonal(), count, parallel_for, near);
  const VectorXf deviation =
      (product(found.transpose(), columns, parallel_for).rowwise().squaredNorm() / static_cast<float>(columns.cols()))
          .cwiseSqrt();
  std::vector<Index> order(static_cast<std::size_t>(count));
  std::iota(order.begin(), order.end(), 0);
  std::ranges::stable_sort(order, std::greater{}, [&](Index k) { return deviation[k]; });
  return {found(Eigen::all, order), deviation(order)};
}

// The snapshots of every third motion, or of all others. Both parts have all kinds of motion, wind and changed
// material.
std::vector<Index> columns_of(const Snapshots& snapshots, bool is_validation) {
  std::vector<Index> columns;
  for (std::size_t s = 0; s < snapshots.motion.size(); ++s)
    if ((snapshots.motion[s] % 3 == 1) == is_validation) columns.push_back(static_cast<Index>(s));
  return columns;
}

// Modes::validation_error for each number of the shapes.
std::vector<float> measure(const Shapes& shapes, const MatrixXf& columns, const Snapshots& snapshots,
                           const ParallelFor& parallel_for) {
  const std::vector<Index> validation = columns_of(snapshots, true);
  const MatrixXf unseen = columns(Eigen::all, validation);
  const MatrixXf squares_m2 = product(shapes.vectors.transpose(), unseen, parallel_for).cwiseAbs2();
  Eigen::MatrixXd error_m2 = Eigen::MatrixXd::Zero(squares_m2.rows(), snapshots.motion.back() + 1);
  Eigen::VectorXd motion_m2 = Eigen::VectorXd::Zero(error_m2.cols());
  for (Index s = 0; s < unseen.cols(); ++s) {
    const std::uint32_t motion = snapshots.motion[static_cast<std::size_t>(validation[static_cast<std::size_t>(s)])];
    double left_m2 = static_cast<double>(unseen.col(s).squaredNorm());
    motion_m2[motion] += left_m2;
    for (Index k = 0; k < squares_m2.rows(); ++k) {
      left_m2 -= static_cast<double>(squares_m2(k, s));
      // Shapes are orthonormal, so each takes its own square off the rest. Rounding may take a little too much.
      error_m2(k, motion) += std::max(left_m2, 0.0);
    }
  }
  // Hair that does not move has no error.
  const auto moving = static_cast<double>(std::max<Index>((motion_m2.array() > 0).count(), 1));
  const Eigen::MatrixXd share = error_m2 * motion_m2.cwiseMax(1e-12).cwiseInverse().asDiagonal();
  const Eigen::VectorXd mean = share.cwiseSqrt().rowwise().sum() / moving;
  std::vector<float> errors;
  for (const double error : mean) errors.push_back(static_cast<float>(error));
  return errors;
}

// The basis of these shapes, whose modes are displacements of nodes.
Basis make_basis(const Shapes& shapes, const Factor& metric) {
  MatrixXf modes = shapes.vectors;
  // Whitened columns are L^T d, so the modes of the nodes are their solutions with L^T.
  by_node(modes) = metric.matrixU().solve(by_node(modes)).eval();
  Basis basis;
  basis.node_count = static_cast<std::size_t>(modes.rows() / 3);
  for (Index k = 0; k < modes.cols(); ++k) {
    basis.deviation_m.push_back(std::max(shapes.deviation_m[k], 1e-9f));
    store_mode(modes.col(k), basis.deviation_m.back(), basis);
  }
  HAIRNET_ASSERT(validate(basis).empty());
  return basis;
}

// Reorders [mode][axis, node] as [mode][node, axis].
ModeMap::Matrix by_axis_last(const MatrixXf& matrix) {
  const Index nodes = matrix.cols() / 3;
  ModeMap::Matrix out(matrix.rows(), matrix.cols());
  for (Index node = 0; node < nodes; ++node)
    for (Index axis = 0; axis < 3; ++axis) out.col(3 * node + axis) = matrix.col(axis * nodes + node);
  return out;
}

// Reorders [mode][node, axis] as [mode][axis, node].
MatrixXf by_axis_first(const ModeMap::Matrix& matrix) {
  const Index nodes = matrix.cols() / 3;
  MatrixXf out(matrix.rows(), matrix.cols());
  for (Index node = 0; node < nodes; ++node)
    for (Index axis = 0; axis < 3; ++axis) out.col(axis * nodes + node) = matrix.col(3 * node + axis);
  return out;
}

// The map that brings a coarse level's snapshots (X) nearest to the coefficients (C) that the finest level has at the
// same moments. It corrects the map R0, which moves the hair as the coarse lattice does. With Y = L^T X, the ridge
// prefers small corrections of the hair's own distances:
//
//     R = R0 + B L^T,     B = (C - R0 X) W Y^T (Y W Y^T + ridge)^-1
ModeMap fit_map(const MatrixXf& first, MatrixXf columns, MatrixXf coefficients, const VectorXf& weights,
                const MatrixXf& metric, const ParallelFor& parallel_for) {
  // The ridge of the regression, relative to the mean square of a number in Y.
  constexpr float kRidge = 1;
  coefficients -= product(first, columns, parallel_for);
  const Factor factor(metric);
  by_node(columns) = (factor.matrixU() * by_node(columns)).eval();
  const MatrixXf weighted = columns * weights.cwiseAbs2().asDiagonal();
  MatrixXf covariance = product(weighted, columns.transpose(), parallel_for);
  covariance.diagonal().array() += kRidge * covariance.trace() / static_cast<float>(covariance.rows());
  MatrixXf map = covariance.llt().solve(product(weighted, coefficients.transpose(), parallel_for));  // B^T
  by_node(map) = (factor.matrixL() * by_node(map)).eval();
  return ModeMap(by_axis_last(first + map.transpose()));
}

}  // namespace

std::size_t Modes::count_within(float error) const {
  const auto found = std::ranges::find_if(validation_error, [error](float own) { return own <= error; });
  return found == validation_error.end() ? 0 : static_cast<std::size_t>(found - validation_error.begin()) + 1;
}

std::shared_ptr<const Modes> make_modes(const Groom& groom, const std::shared_ptr<const LevelSet>& levels,
                                        const BuildCallbacks& callbacks, const ParallelFor& parallel_for,
                                        const ModeTraining& training) {
  HAIRNET_ASSERT(levels);
  HAIRNET_ASSERT(training.motion_count >= 2);
  const auto at = [&](double share, const char* stage) {
    return !callbacks.progress || callbacks.progress(share, stage);
  };
  const auto moving = [&](double share) { return at(0.7 * share, "moving the hair"); };
  Snapshots snapshots = take_snapshots(groom, levels, training, moving, parallel_for);
  if (snapshots.motion.empty() || !at(0.7, "finding the modes")) return nullptr;

  const MatrixXf metric = hair_metric(groom, levels->levels[0]);
  const Factor factor(metric);
  HAIRNET_ASSERT(factor.info() == Eigen::Success);
  MatrixXf columns = snapshots.levels[0];
  by_node(columns) = (factor.matrixU() * by_node(columns)).eval();
  const VectorXf weights = weights_of(columns, snapshots);
  auto modes = std::make_shared<Modes>();
  // A basis of two thirds of the motions says how many modes the hair needs.
  const std::vector<Index> seen = columns_of(snapshots, false);
  const Index most = std::min({static_cast<Index>(kModeCountMax), columns.rows(), static_cast<Index>(seen.size())});
  const Shapes trial = find_shapes(columns(Eigen::all, seen), weights(seen), most, {}, parallel_for);
  modes->validation_error = measure(trial, columns, snapshots, parallel_for);
  if (!at(0.8, "finding the modes")) return nullptr;
  // Zero says that even all modes err by more.
  const auto needed = static_cast<Index>(modes->count_within(training.error_max));
  const Index count = needed == 0 ? most : std::min(most, std::max<Index>((needed + 15) / 16 * 16, kModeCountMin));
  modes->validation_error.resize(static_cast<std::size_t>(count));
  // The basis in use is made from all motions, and starts from the trial's vectors, which are near.
  modes->basis = make_basis(find_shapes(columns, weights, count, trial.vectors, parallel_for), factor);
  modes->maps[0] = make_projection(modes->basis, metric);

  if (!at(0.9, "fitting the levels")) return nullptr;
  const MatrixXf projection = by_axis_first(modes->maps[0].matrix());
  const MatrixXf coefficients = product(projection, snapshots.levels[0], parallel_for);
  const Index nodes = metric.rows();
  for (std::size_t i = 1; i < modes->maps.size(); ++i) {
    const LevelMap* map = levels->map(static_cast<LevelIndex>(i), LevelIndex::high);
    HAIRNET_ASSERT(map);
    const Index own_nodes = snapshots.levels[i].rows() / 3;
    // Where the level has the nodes of the finest, its first map is the finest level's projection.
    MatrixXf first = projection;
    if (map->matrix().size() > 0) {
      first.resize(projection.rows(), 3 * own_nodes);
      for (Index axis = 0; axis < 3; ++axis) {
        first.middleCols(axis * own_nodes, own_nodes) = projection.middleCols(axis * nodes, nodes) * map->matrix();
      }
    }
    modes->maps[i] = fit_map(first, std::move(snapshots.levels[i]), coefficients, weights,
                             hair_metric(groom, levels->levels[i]), parallel_for);
  }
  return modes;
}

}  // namespace hairnet
