#include <Eigen/IterativeLinearSolvers>
#include <Eigen/SparseCore>

#include "tests/bench/baseline_forces.hpp"

namespace hairnet::bench {
namespace {

using Sparse = Eigen::SparseMatrix<double>;
using Triplets = std::vector<Eigen::Triplet<double>>;

// Adds the nine numbers of the 3x3 block of two nodes.
void add_block(std::size_t row_node, std::size_t column_node, const Eigen::Matrix3d& block, Triplets& triplets) {
  const auto row = static_cast<int>(3 * row_node), column = static_cast<int>(3 * column_node);
  for (int c = 0; c < 3; ++c) {
    for (int r = 0; r < 3; ++r) triplets.emplace_back(row + r, column + c, block(r, c));
  }
}

// A stiffener adds a block for each pair of its nodes: w_i w_j times its own.
void add_stiffener(const StiffenerBlock& s, Triplets& triplets) {
  const PlainStiffeners& list = *s.stiffeners;
  for (std::uint32_t i = list.begin[s.index]; i < list.begin[s.index + 1]; ++i) {
    for (std::uint32_t j = list.begin[s.index]; j < list.begin[s.index + 1]; ++j) {
      add_block(list.nodes[i], list.nodes[j], list.weights[i] * list.weights[j] * s.block, triplets);
    }
  }
}

// The paper's step in the plainest way: the matrix is made again in each step, from a list of its numbers.
class NaiveStep final : public BaselineStep {
 public:
  NaiveStep(const PlainLevel& level, const BaselineSettings& settings) : level_(level) {
    const auto n = static_cast<Eigen::Index>(3 * level.node_count);
    matrix_.resize(n, n);
    solver_.setMaxIterations(settings.iterations);
    solver_.setTolerance(settings.relative_residual);
  }

  bool step(const PlainInput& input, double* P, double* P_dot) override {
    const auto n = static_cast<Eigen::Index>(level_.node_count);
    NodeVectors positions(P, 3, n), velocities(P_dot, 3, n);
    compute_system(level_, input, positions, velocities, system_);
    triplets_.clear();
    for (std::size_t i = 0; i < level_.node_count; ++i) add_block(i, i, system_.node_blocks[i], triplets_);
    for (const StiffenerBlock& s : system_.springs) add_stiffener(s, triplets_);
    for (const StiffenerBlock& s : system_.attachments) add_stiffener(s, triplets_);
    matrix_.setFromTriplets(triplets_.begin(), triplets_.end());
    solver_.compute(matrix_);
    dP_dot_ = solver_.solve(system_.load);
    return advance(input.step_s, dP_dot_, positions, velocities);
  }

 private:
  PlainLevel level_;
  BaselineSystem system_;
  Triplets triplets_;
  Sparse matrix_;
  Eigen::ConjugateGradient<Sparse, Eigen::Lower | Eigen::Upper, Eigen::IdentityPreconditioner> solver_;
  Eigen::VectorXd dP_dot_;
};

}  // namespace

std::unique_ptr<BaselineStep> make_naive_step(const PlainLevel& level, const BaselineSettings& settings) {
  return std::make_unique<NaiveStep>(level, settings);
}

}  // namespace hairnet::bench
