#include "core/levels/level_map.hpp"

#include <Eigen/Cholesky>
#include <Eigen/SparseCore>
#include <algorithm>
#include <optional>
#include <vector>

#include "core/assert.hpp"
#include "core/levels/ffd_matrix.hpp"

namespace hairnet {
namespace {

using Matrix = Eigen::SparseMatrix<double>;
using Triplets = ActiveCombinations::Triplets;

// The weight of following the old lattice directly, as a share of the mean diagonal of F^T F. It is enough to fix the
// nodes on which no hair depends, and too little to show at the other nodes.
constexpr double kFollow = 1e-3;

Matrix assembled(Eigen::Index rows, Eigen::Index columns, const Triplets& triplets) {
  Matrix matrix(rows, columns);
  matrix.setFromTriplets(triplets.begin(), triplets.end());
  return matrix;
}

// The matrix from displacements of `from` to the nodes of `to`. Inside the lattice of `from` it interpolates linearly,
// and outside it takes the value of the nearest face.
Matrix sampling_matrix(const Level& from, const Level& to) {
  const ActiveCombinations active(from.geometry);
  const Lattice& lattice = from.geometry.lattice;
  Triplets triplets;
  for (std::size_t n = 0; n < to.rest.size(); ++n) {
    const Vec3f g = (to.rest[n] - lattice.origin).cwiseQuotient(lattice.spacing);
    std::array<int, 3> low{};
    Vec3f t;
    for (int a = 0; a < 3; ++a) {
      const auto most = static_cast<float>(lattice.dims[static_cast<std::size_t>(a)] - 1);
      const float inside = std::clamp(g[a], 0.0f, most);
      low[static_cast<std::size_t>(a)] = static_cast<int>(std::min(std::floor(inside), most - 1));
      t[a] = inside - std::min(std::floor(inside), most - 1);
    }
    for (int corner = 0; corner < 8; ++corner) {
      const int i = corner & 1, j = corner >> 1 & 1, k = corner >> 2;
      const float weight = (i ? t[0] : 1 - t[0]) * (j ? t[1] : 1 - t[1]) * (k ? t[2] : 1 - t[2]);
      active.add(lattice.index(low[0] + i, low[1] + j, low[2] + k), double{weight}, static_cast<Eigen::Index>(n),
                 triplets);
    }
  }
  return assembled(static_cast<Eigen::Index>(to.rest.size()), static_cast<Eigen::Index>(from.rest.size()), triplets);
}

// Whether both levels have the same nodes at the same places.
bool has_same_nodes(const LevelGeometry& a, const LevelGeometry& b) {
  return a.lattice.origin == b.lattice.origin && a.lattice.spacing == b.lattice.spacing &&
         a.lattice.dims == b.lattice.dims && a.active_nodes == b.active_nodes;
}

}  // namespace

// A level as the source or the target of maps: its matrix F from nodes to hair points and, for maps to it, the factors
// of F^T F + follow.
struct LevelMap::End {
  End(const Level& of, std::span<const Vec3f> points, std::span<const float> blend)
      : level(&of), F(ffd_matrix(of, points, blend)), F_transposed(F.transpose()) {
    HAIRNET_ASSERT(!of.rest.empty());
    HAIRNET_ASSERT(of.rest.size() == of.geometry.active_nodes.size());
    Eigen::MatrixXd normal = F_transposed * F;
    follow = kFollow * std::max(normal.diagonal().mean(), 1e-9);
    // Without this term the matrix is singular where no sampled point depends on a node.
    normal.diagonal().array() += follow;
    factor.compute(normal);
    HAIRNET_ASSERT(factor.info() == Eigen::Success);
  }

  const Level* level;
  Matrix F, F_transposed;
  double follow = 0;
  Eigen::LLT<Eigen::MatrixXd> factor;
};

LevelMap::LevelMap(const Level& from, const Level& to, std::span<const Vec3f> points_head, std::span<const float> blend)
    : LevelMap(End(from, points_head, blend), End(to, points_head, blend)) {}

// Solves (F^T F + follow) to = (F^T F_from + follow S) from, where S is the sampling matrix.
LevelMap::LevelMap(const End& from, const End& to) {
  // An empty matrix stands for the identity, so low and ether hair change over without rounding.
  if (has_same_nodes(from.level->geometry, to.level->geometry)) return;
  const Matrix right = Matrix(to.F_transposed * from.F) + to.follow * sampling_matrix(*from.level, *to.level);
  matrix_ = to.factor.solve(Eigen::MatrixXd(right)).cast<float>();
  HAIRNET_ASSERT(matrix_.rows() == static_cast<Eigen::Index>(to.level->rest.size()));
  HAIRNET_ASSERT(matrix_.cols() == static_cast<Eigen::Index>(from.level->rest.size()));
}

void LevelMap::apply(std::span<const Vec3f> from, std::span<Vec3f> to) const {
  using Nodes = Eigen::Matrix<float, Eigen::Dynamic, 3, Eigen::RowMajor>;
  if (matrix_.size() == 0) {
    HAIRNET_ASSERT(from.size() == to.size());
    std::ranges::copy(from, to.begin());
    return;
  }
  HAIRNET_ASSERT(static_cast<Eigen::Index>(from.size()) == matrix_.cols());
  HAIRNET_ASSERT(static_cast<Eigen::Index>(to.size()) == matrix_.rows());
  static_assert(sizeof(Vec3f) == 3 * sizeof(float));
  Eigen::Map<Nodes>(to.front().data(), matrix_.rows(), 3).noalias() =
      matrix_ * Eigen::Map<const Nodes>(from.front().data(), matrix_.cols(), 3);
}

void make_level_maps(LevelSet& set, std::span<const Vec3f> points_head, std::span<const float> blend,
                     const ParallelFor& parallel_for) {
  const std::size_t count = set.levels.size();
  // The factors of a level serve all maps to it: four factorisations instead of twelve.
  std::vector<std::optional<LevelMap::End>> ends(count);
  run_loop(parallel_for, count, [&](std::size_t i) { ends[i].emplace(set.levels[i], points_head, blend); });
  run_loop(parallel_for, count * count, [&](std::size_t pair) {
    const std::size_t from = pair / count, to = pair % count;
    if (from == to) return;
    set.maps[from][to] = std::shared_ptr<const LevelMap>(new LevelMap(*ends[from], *ends[to]));
  });
}

}  // namespace hairnet
