#include "core/solver/lane_memory.hpp"

#include <algorithm>

#include "core/assert.hpp"
#include "core/solver/step_terms.hpp"
#include "core/solver/touch_terms.hpp"

namespace hairnet {

LaneMemory LaneArena::allocate(const LaneSizes& sizes, const LevelView& level) {
  HAIRNET_ASSERT(sizes.real > 0);
  // A vector has three numbers, and a symmetric 3x3 block six different ones. A layout may add padding.
  HAIRNET_ASSERT(sizes.vector >= 3 * sizes.real);
  HAIRNET_ASSERT(sizes.block >= 6 * sizes.real);
  LaneMemory memory;
  struct Part {
    float** at;
    std::size_t floats;
  };
  const std::size_t node_vectors = level.node_count * sizes.vector, node_blocks = level.node_count * sizes.block;
  const std::array parts{
      Part{&terms_, kStepTermCount * sizes.real},
      Part{&memory.displacement, node_vectors},
      Part{&memory.velocity, node_vectors},
      Part{&memory.rigid_velocity, node_vectors},
      Part{&memory.rotated_displacement, node_vectors},
      Part{&memory.solution, node_vectors},
      Part{&memory.residual, node_vectors},
      Part{&memory.preconditioned, node_vectors},
      Part{&memory.direction, node_vectors},
      Part{&memory.product, node_vectors},
      Part{&memory.attachment_diagonal, level.node_count * sizes.real},
      Part{&memory.diagonal, node_blocks},
      Part{&memory.preconditioner, node_blocks},
      Part{&memory.spring_direction, level.springs.count * sizes.vector},
      Part{&memory.spring_elongation, level.springs.count * sizes.real},
      Part{&memory.spring_coefficient, level.springs.count * sizes.real},
      Part{&memory.spring_change, level.springs.count * sizes.real},
      Part{&memory.attachment_displacement, level.attachments.count * sizes.vector},
      Part{&memory.attachment_coefficient, level.attachments.count * sizes.real},
      Part{&memory.pull, (level.springs.count + level.attachments.count) * sizes.vector},
      Part{&memory.bodies, level.body_count * kBodyTermCount * sizes.real},
      Part{&memory.holds, level.hold_count * kHoldTermCount * sizes.real},
      Part{&memory.hold_force, level.hold_count * sizes.vector},
      Part{&memory.elastic_energy_max_j, sizes.real},
      Part{&memory.speed_max, sizes.real},
      Part{&memory.is_finite, sizes.real},
  };
  static_assert(std::tuple_size_v<decltype(parts)> * sizeof(float*) == sizeof(LaneMemory), "each pointer gets a part");
  // Each array begins on a cache line: aligned loads of the widest register are then allowed.
  constexpr std::size_t kLine = std::tuple_size_v<decltype(Line::floats)>;
  const auto lines = [](std::size_t floats) { return (floats + kLine - 1) / kLine; };
  std::size_t count = 0;
  for (const Part& part : parts) count += lines(part.floats);
  // A resize moves the block, so pointers of an earlier allocation are invalid. A smaller level uses the front of the
  // block.
  if (lines_.size() < count) lines_.resize(count);
  Line* next = lines_.data();
  for (const Part& part : parts) {
    *part.at = next->floats.data();
    next += lines(part.floats);
  }
  HAIRNET_ASSERT(next == lines_.data() + count);
  memory.terms = terms_;
  return memory;
}

}  // namespace hairnet
