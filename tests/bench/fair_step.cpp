#include <Eigen/IterativeLinearSolvers>
#include <Eigen/SparseCore>
#include <algorithm>

#include "tests/bench/baseline_forces.hpp"

namespace hairnet::bench {
namespace {

using Sparse = Eigen::SparseMatrix<double>;

// Where a 3x3 block lies among the values of the sparse matrix, which stands column by column: the block's columns are
// `stride` values apart, with three values each.
struct BlockPlace {
  std::uint32_t begin, stride;
};

// For each column of blocks the rows that have one, ascending: the diagonal, and wherever two nodes share a stiffener.
std::vector<std::vector<std::uint32_t>> block_columns(const PlainLevel& level) {
  std::vector<std::vector<std::uint32_t>> columns(level.node_count);
  for (std::uint32_t i = 0; i < level.node_count; ++i) columns[i].push_back(i);
  for (const PlainStiffeners* list : {&level.springs, &level.attachments}) {
    for (std::size_t s = 0; s < list->count; ++s) {
      const std::uint16_t *begin = list->nodes + list->begin[s], *end = list->nodes + list->begin[s + 1];
      for (const std::uint16_t* j = begin; j != end; ++j) columns[*j].insert(columns[*j].end(), begin, end);
    }
  }
  for (auto& rows : columns) {
    std::ranges::sort(rows);
    rows.erase(std::unique(rows.begin(), rows.end()), rows.end());
  }
  return columns;
}

// The paper's step as a good engineer would write it: the pattern of the matrix is found once, and each step only adds
// the numbers at known places. NaiveStep (naive_step.cpp) collects and sorts them in each step.
class FairStep final : public BaselineStep {
 public:
  FairStep(const PlainLevel& level, const BaselineSettings& settings) : level_(level) {
    const auto columns = block_columns(level);
    make_pattern(columns);
    const auto place = [&](std::uint32_t row, std::uint32_t column) {
      const auto& rows = columns[column];
      const auto rank = std::ranges::lower_bound(rows, row) - rows.begin();
      return BlockPlace{static_cast<std::uint32_t>(matrix_.outerIndexPtr()[3 * column] + 3 * rank),
                        static_cast<std::uint32_t>(3 * rows.size())};
    };
    for (std::uint32_t i = 0; i < level.node_count; ++i) node_places_.push_back(place(i, i));
    for (const auto& [list, places] : {std::pair{&level.springs, &springs_}, {&level.attachments, &attachments_}}) {
      places->begin.push_back(0);
      for (std::size_t s = 0; s < list->count; ++s) {
        for (std::uint32_t j = list->begin[s]; j < list->begin[s + 1]; ++j) {
          for (std::uint32_t i = list->begin[s]; i < list->begin[s + 1]; ++i) {
            places->blocks.push_back(place(list->nodes[i], list->nodes[j]));
          }
        }
        places->begin.push_back(places->blocks.size());
      }
    }
    solver_.setMaxIterations(settings.iterations);
    solver_.setTolerance(settings.relative_residual);
  }

  bool step(const PlainInput& input, double* P, double* P_dot) override {
    const auto n = static_cast<Eigen::Index>(level_.node_count);
    NodeVectors positions(P, 3, n), velocities(P_dot, 3, n);
    compute_system(level_, input, positions, velocities, system_);
    std::fill_n(matrix_.valuePtr(), matrix_.nonZeros(), 0.0);
    for (std::size_t i = 0; i < level_.node_count; ++i) add(node_places_[i], system_.node_blocks[i]);
    for (const StiffenerBlock& s : system_.springs) add_spring(s);
    for (const StiffenerBlock& s : system_.attachments) add_attachment(s);
    solver_.compute(matrix_);
    dP_dot_ = solver_.solve(system_.load);
    return advance(input.step_s, dP_dot_, positions, velocities);
  }

 private:
  // The places of one kind of stiffener: `blocks` has one for each pair of a stiffener's nodes, and those of stiffener
  // s begin at `begin[s]`.
  struct Places {
    std::vector<std::size_t> begin;
    std::vector<BlockPlace> blocks;
  };

  // Fills the column begins and the row numbers of the matrix, three columns for each column of blocks. The values come
  // in each step.
  void make_pattern(const std::vector<std::vector<std::uint32_t>>& columns) {
    const auto n = static_cast<Eigen::Index>(3 * level_.node_count);
    std::size_t block_count = 0;
    for (const auto& rows : columns) block_count += rows.size();
    matrix_.resize(n, n);
    matrix_.resizeNonZeros(static_cast<Eigen::Index>(9 * block_count));
    int* row = matrix_.innerIndexPtr();
    int* begin = matrix_.outerIndexPtr();
    *begin = 0;
    for (const auto& rows : columns) {
      for (int c = 0; c < 3; ++c, ++begin) {
        begin[1] = begin[0] + static_cast<int>(3 * rows.size());
        for (const std::uint32_t node : rows) {
          for (int r = 0; r < 3; ++r) *row++ = static_cast<int>(3 * node) + r;
        }
      }
    }
  }

  void add(const BlockPlace& place, const Eigen::Matrix3d& block) {
    double* values = matrix_.valuePtr() + place.begin;
    for (int c = 0; c < 3; ++c, values += place.stride) {
      for (int r = 0; r < 3; ++r) values[r] += block(r, c);
    }
  }

  void add_spring(const StiffenerBlock& s) {
    const PlainStiffeners& list = *s.stiffeners;
    const BlockPlace* place = springs_.blocks.data() + springs_.begin[s.index];
    for (std::uint32_t j = list.begin[s.index]; j < list.begin[s.index + 1]; ++j) {
      for (std::uint32_t i = list.begin[s.index]; i < list.begin[s.index + 1]; ++i) {
        add(*place++, list.weights[i] * list.weights[j] * s.block);
      }
    }
  }

  // The block of an attachment is a multiple of the identity, so only the three numbers of its diagonal are added.
  void add_attachment(const StiffenerBlock& s) {
    const PlainStiffeners& list = *s.stiffeners;
    const BlockPlace* place = attachments_.blocks.data() + attachments_.begin[s.index];
    for (std::uint32_t j = list.begin[s.index]; j < list.begin[s.index + 1]; ++j) {
      for (std::uint32_t i = list.begin[s.index]; i < list.begin[s.index + 1]; ++i, ++place) {
        double* values = matrix_.valuePtr() + place->begin;
        const double a = list.weights[i] * list.weights[j] * s.block(0, 0);
        for (std::uint32_t c = 0; c < 3; ++c) values[c * place->stride + c] += a;
      }
    }
  }

  PlainLevel level_;
  BaselineSystem system_;
  Sparse matrix_;
  std::vector<BlockPlace> node_places_;
  Places springs_, attachments_;
  Eigen::ConjugateGradient<Sparse, Eigen::Lower | Eigen::Upper, Eigen::IdentityPreconditioner> solver_;
  Eigen::VectorXd dP_dot_;
};

}  // namespace

std::unique_ptr<BaselineStep> make_fair_step(const PlainLevel& level, const BaselineSettings& settings) {
  return std::make_unique<FairStep>(level, settings);
}

}  // namespace hairnet::bench
