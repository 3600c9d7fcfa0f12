#pragma once

#include <Eigen/SparseCholesky>
#include <array>
#include <cstdint>
#include <vector>

#include "core/solver/reference_step.hpp"

namespace hairnet::fidelity {

// The step of reference_step.cpp, solved directly: the system is assembled once a step, as a sparse matrix over the
// nodes, and factored. Its cost hardly depends on the number of springs, so that tens of thousands are affordable.
class DirectStep {
 public:
  explicit DirectStep(const Level& level);  // kept by reference

  // False when the system is not positive definite, or its solution not finite; the lattice is then worthless.
  [[nodiscard]] bool step(const StepInput& input, WorldLattice& lattice);

 private:
  // The lower half of a symmetric 3 x 3 block: xx xy xz yy yz zz. Every block of the matrix is symmetric.
  using Block = std::array<double, 6>;

  void find_pattern();
  void add_nodes(const StepInput& input, const WorldLattice& lattice);
  void add_springs(double h, const WorldLattice& lattice);
  void add_attachments(const StepInput& input, const WorldLattice& lattice);
  void add_contacts(const StepInput& input, const WorldLattice& lattice);
  void add_pairs(const Stiffeners& stiffeners, std::size_t s, const std::vector<std::uint32_t>& slots,
                 std::size_t slot_begin, const Block& block);
  void fill_matrix();

  const Level& level_;
  // Blocks on and below the diagonal, column by column, rows ascending: block b is at (rows_[b], its column).
  std::vector<std::uint32_t> column_begin_, rows_;
  std::vector<Block> blocks_;
  std::vector<std::uint32_t> spring_slots_, attachment_slots_;  // of each stiffener's pairs of nodes, in turn
  std::vector<Vec3> load_;                                      // h (f + h df/dp P')
  Eigen::SparseMatrix<double> matrix_;                          // M - h df/dp' - h^2 df/dp, lower half
  Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> factors_;
};

}  // namespace hairnet::fidelity
