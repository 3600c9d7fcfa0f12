#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "core/assert.hpp"
#include "core/solver/level_view.hpp"

namespace hairnet {

// The working memory of one step in one layout (lanes_inl.hpp). Each pointer is an array; the comment before it says of
// what and how many. All arrays lie in one block, in the order in which a step uses them.
struct LaneMemory {
  // The numbers of StepTerms, one Real each.
  const float* terms = nullptr;

  // Vectors, one a node. `velocity` becomes R v - R' P^0 within a step, `residual` begins as the right-hand side b.
  float *displacement, *velocity, *rigid_velocity, *rotated_displacement;
  float *solution, *residual, *preconditioned, *direction, *product;
  // Reals, one a node: the attachments' part of the diagonal.
  float* attachment_diagonal;
  // Blocks, one a node: the node's own part of the system A, and the inverse of its whole 3x3 block.
  float *diagonal, *preconditioner;

  // Vectors, one a spring: the direction eps / |eps|.
  float* spring_direction;
  // Reals, one a spring: the elongation |eps| - |eps_0|, m, and the coefficient h (h k + q) of the system.
  float *spring_elongation, *spring_coefficient;
  // Reals, one a spring: the strain's addition to k, over k (SpringBranch in spring.hpp).
  float* spring_change;
  // Vectors, one an attachment: eps - eps_0, m.
  float* attachment_displacement;
  // Reals, one an attachment: the coefficient h (h k + q).
  float* attachment_coefficient;
  // Vectors: the force sigma of each spring, then of each attachment. Only a crowd uses them.
  float* pull;

  // The BodyTerms of each body, one Real a number.
  float* bodies;
  // The HoldTerms of each hold, one float a number: no crowd has holds.
  float* holds;
  // Vectors, one a hold: the force on the held point, N.
  float* hold_force;

  // Results of the step, one Real each. The first two go into LatticeState; `is_finite` is 1 or 0.
  float *elastic_energy_max_j, *speed_max, *is_finite;
};

// How many floats a Real, a Vector and a Block of a layout take in memory.
struct LaneSizes {
  std::size_t real, vector, block;
};

// The memory of LaneMemory. It grows to the largest level so far and never shrinks, so that later steps allocate
// nothing. It belongs to one thread at a time.
class LaneArena {
 public:
  // Returns arrays for a step of this level. Their numbers are not set. The call makes all pointers of earlier calls
  // invalid.
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
