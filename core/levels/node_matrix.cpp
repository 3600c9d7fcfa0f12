#include "core/levels/node_matrix.hpp"

#include <algorithm>
#include <functional>
#include <limits>

#include "core/assert.hpp"

namespace hairnet {
namespace {

void add_scaled(const SymmetricBlock& from, double scale, SymmetricBlock& to) {
  for (std::size_t c = 0; c < 6; ++c) to[c] += scale * from[c];
}

using Factor = Eigen::SparseMatrix<double>;

// Where a SymmetricBlock stores the number of (row, column).
constexpr std::size_t kPlace[3][3] = {{0, 1, 2}, {1, 3, 4}, {2, 4, 5}};

}  // namespace

SymmetricBlock isotropic_and_axial(double a, double b, const Vec3& e) {
  return {a + b * e[0] * e[0], b * e[0] * e[1], b * e[0] * e[2],
          a + b * e[1] * e[1], b * e[1] * e[2], a + b * e[2] * e[2]};
}

SymmetricBlock scaled(double a, const SymmetricBlock& block) {
  SymmetricBlock result{};
  add_scaled(block, a, result);
  return result;
}

NodeMatrix::NodeMatrix(std::size_t node_count, std::initializer_list<const Stiffeners*> lists) {
  HAIRNET_ASSERT(node_count <= std::numeric_limits<std::uint16_t>::max());
  // Whether two nodes share a stiffener, as [column][row]; only rows from the column on are set.
  std::vector<std::vector<bool>> is_coupled(node_count, std::vector<bool>(node_count, false));
  for (std::size_t i = 0; i < node_count; ++i) is_coupled[i][i] = true;
  for (const Stiffeners* list : lists) {
    HAIRNET_ASSERT(list->begin.size() == list->count() + 1);
    HAIRNET_ASSERT(list->begin.back() == list->nodes.size());
    HAIRNET_VALIDATE(std::ranges::all_of(list->nodes, [&](std::uint16_t node) { return node < node_count; }));
    for (std::size_t s = 0; s < list->count(); ++s) {
      for (std::uint32_t j = list->begin[s]; j < list->begin[s + 1]; ++j) {
        for (std::uint32_t i = j; i < list->begin[s + 1]; ++i) is_coupled[list->nodes[j]][list->nodes[i]] = true;
      }
    }
  }
  std::vector<Eigen::Triplet<double>> places;
  for (std::uint32_t j = 0; j < node_count; ++j) {
    for (std::uint32_t i = j; i < node_count; ++i) {
      if (!is_coupled[j][i]) continue;
      rows_.push_back(i);
      for (std::uint32_t c = 0; c < 3; ++c) {
        for (std::uint32_t r = i == j ? c : 0; r < 3; ++r) places.emplace_back(3 * i + r, 3 * j + c, 0.0);
      }
    }
    column_begin_.push_back(static_cast<std::uint32_t>(rows_.size()));
  }
  blocks_.resize(rows_.size());
  HAIRNET_ASSERT(column_begin_.size() == node_count + 1);
  const auto size = static_cast<Eigen::Index>(3 * node_count);
  matrix_.resize(size, size);
  matrix_.setFromTriplets(places.begin(), places.end());
  // The pattern never changes, so the order that keeps the factors sparse is found once for all factorisations.
  factors_.analyzePattern(matrix_);
  HAIRNET_ASSERT(static_cast<std::size_t>(matrix_.nonZeros()) == 9 * blocks_.size() - 3 * node_count);
}

void NodeMatrix::set_zero() {
  std::ranges::fill(blocks_, SymmetricBlock{});
  is_factored_ = false;
}

void NodeMatrix::add(std::size_t node, const SymmetricBlock& block) {
  HAIRNET_ASSERT(node + 1 < column_begin_.size());
  HAIRNET_ASSERT(rows_[column_begin_[node]] == node);
  add_scaled(block, 1, blocks_[column_begin_[node]]);
  is_factored_ = false;
}

void NodeMatrix::add(std::span<const std::uint16_t> nodes, std::span<const double> weights,
                     const SymmetricBlock& block) {
  HAIRNET_ASSERT(weights.size() == nodes.size());
  HAIRNET_ASSERT(nodes.empty() || nodes.back() + 1u < column_begin_.size());
  HAIRNET_VALIDATE(std::ranges::adjacent_find(nodes, std::greater_equal{}) == nodes.end());
  is_factored_ = false;
  for (std::size_t j = 0; j < nodes.size(); ++j) {
    auto place = rows_.begin() + column_begin_[nodes[j]];
    const auto column_end = rows_.begin() + column_begin_[nodes[j] + 1u];
    for (std::size_t i = j; i < nodes.size(); ++i) {
      // Both lists ascend, so each search goes on where the last one ended.
      place = std::lower_bound(place, column_end, nodes[i]);
      HAIRNET_ASSERT(place != column_end);
      HAIRNET_ASSERT(*place == nodes[i]);
      add_scaled(block, weights[i] * weights[j], blocks_[static_cast<std::size_t>(place - rows_.begin())]);
    }
  }
}

bool NodeMatrix::factor() {
  fill_values();
  factors_.factorize(matrix_);
  is_factored_ = factors_.info() == Eigen::Success;
  return is_factored_;
}

// Solves for all columns of `loads` in one pass through the factors, since the columns of a row are adjacent in memory
// here. Eigen's own solve goes through the factors once for each column.
Eigen::MatrixXd NodeMatrix::solve(const Eigen::MatrixXd& loads) const {
  HAIRNET_ASSERT(is_factored_);
  HAIRNET_ASSERT(loads.rows() == matrix_.rows());
  using RowByRow = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  // The entries are those below the unit diagonal, column by column.
  const auto& lower = factors_.matrixL().nestedExpression();
  RowByRow x = factors_.permutationP() * loads;
  for (Eigen::Index i = 0; i < x.rows(); ++i) {
    for (Factor::InnerIterator entry(lower, i); entry; ++entry) {
      if (entry.row() > i) x.row(entry.row()) -= entry.value() * x.row(i);
    }
  }
  x = factors_.vectorD().asDiagonal().inverse() * x;
  for (Eigen::Index i = x.rows(); i-- > 0;) {
    for (Factor::InnerIterator entry(lower, i); entry; ++entry) {
      if (entry.row() > i) x.row(i) -= entry.value() * x.row(entry.row());
    }
  }
  return factors_.permutationPinv() * x;
}

// Writes the blocks in the order of Eigen's compressed columns, without searching a place for any number.
void NodeMatrix::fill_values() {
  double* value = matrix_.valuePtr();
  for (std::size_t j = 0; j + 1 < column_begin_.size(); ++j) {
    for (std::size_t c = 0; c < 3; ++c) {
      for (std::uint32_t b = column_begin_[j]; b < column_begin_[j + 1]; ++b) {
        for (std::size_t r = rows_[b] == j ? c : 0; r < 3; ++r) *value++ = blocks_[b][kPlace[r][c]];
      }
    }
  }
  HAIRNET_ASSERT(value == matrix_.valuePtr() + matrix_.nonZeros());
}

}  // namespace hairnet
