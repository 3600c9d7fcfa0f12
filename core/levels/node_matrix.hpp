#pragma once

#include <Eigen/SparseCholesky>
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "core/levels/level.hpp"

namespace hairnet {

// A symmetric 3 x 3 block: xx xy xz yy yz zz.
using SymmetricBlock = std::array<double, 6>;

// a I + b e e^T
SymmetricBlock isotropic_and_axial(double a, double b, const Vec3& e);
SymmetricBlock scaled(double a, const SymmetricBlock& block);

// The symmetric positive definite matrix of a linear system over a level's nodes, three unknowns each, assembled block
// by block and factored (LDL^T). Every block is symmetric itself: stiffeners give w_i w_j (a I + b e e^T).
class NodeMatrix {
 public:
  // Allocates blocks on the diagonal and for every two nodes that share a stiffener of `lists`. Asserts that the
  // counts of each list agree.
  NodeMatrix(std::size_t node_count, std::initializer_list<const Stiffeners*> lists);

  void set_zero();
  // Asserts that the node exists.
  void add(std::size_t node, const SymmetricBlock& block);
  // Adds w_i w_j `block` for all pairs (i, j) of `nodes`, ascending. Asserts that each pair shares a stiffener,
  // and that there is one weight for each node.
  void add(std::span<const std::uint16_t> nodes, std::span<const double> weights, const SymmetricBlock& block);

  // Returns false when the matrix is not positive definite.
  [[nodiscard]] bool factor();
  // Solves for each column; rows 3 i .. 3 i + 2 belong to node i. Asserts that factor() has returned true since the
  // last change.
  [[nodiscard]] Eigen::MatrixXd solve(const Eigen::MatrixXd& loads) const;

 private:
  void fill_values();

  // Blocks on and below the diagonal, column by column, rows ascending.
  std::vector<std::uint32_t> column_begin_{0}, rows_;
  std::vector<SymmetricBlock> blocks_;
  // Only the lower half is stored.
  Eigen::SparseMatrix<double> matrix_;
  Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> factors_;
  // Whether factors_ are those of blocks_.
  bool is_factored_ = false;
};

}  // namespace hairnet
