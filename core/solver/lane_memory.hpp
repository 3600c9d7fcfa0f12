#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "core/assert.hpp"
#include "core/solver/level_view.hpp"

namespace hairnet {

// The working memory of one step in one layout (lanes_inl.hpp). Each pointer is an array of one value per node, spring
// or attachment. All arrays lie in one block, in the order in which a step uses them.
struct LaneMemory {
  // Has StepTerms, one Real each.
  const float* terms = nullptr;

  // Vectors of nodes. `velocity` becomes R v - R' P^0 within a step, `residual` begins as the right-hand side b.
  float *displacement, *velocity, *rigid_velocity, *rotated_displacement;
  float *solution, *residual, *preconditioned, *direction, *product;
  // Has Reals of nodes: the attachments' part of the diagonal.
  float* attachment_diagonal;
  // Have Blocks of nodes: a node's own part of the system, and the inverse of its whole block.
  float *diagonal, *preconditioner;

  // Has Vectors, eps / |eps|.
  float* spring_direction;
  // Have Reals: |eps| - |eps_0|, m, and h (h k + q).
  float *spring_elongation, *spring_coefficient;
  // Has Reals: the strain's addition to k, over k (SpringBranch).
  float* spring_change;
  // Has Vectors, eps - eps_0.
  float* attachment_displacement;
  // Has Reals.
  float* attachment_coefficient;
  // Has Vectors: sigma of springs, then of attachments.
  float* pull;

  // Has the BodyTerms of each body, one Real each.
  float* bodies;
  // Has the HoldTerms of each hold.
  float* holds;
  // Has Vectors: the forces on held points, N.
  float* hold_force;

  // Have one Real each, with results of the step (LatticeState; 1 or 0).
  float *elastic_energy_max_j, *speed_max, *is_finite;
};

// Floats of one Real, Vector and Block of a layout.
struct LaneSizes {
  std::size_t real, vector, block;
};

// Grows to the largest level so far and never shrinks, so that later steps allocate nothing. It belongs to one thread
// at a time.
class LaneArena {
 public:
  LaneMemory allocate(const LaneSizes& sizes, const LevelView& level);
  // Where the terms of the memory that was allocated last are. Asserts that `allocate` has been called.
  [[nodiscard]] float* terms() {
    HAIRNET_ASSERT(terms_);
    return terms_;
  }

 private:
  struct alignas(64) Line {
    std::array<float, 16> floats;
  };
  std::vector<Line> lines_;
  float* terms_ = nullptr;
};

}  // namespace hairnet
