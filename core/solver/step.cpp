#include "core/solver/step.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "core/assert.hpp"
#include "core/solver/head_motion.hpp"
#include "core/solver/kernels.hpp"
#include "core/solver/step_terms.hpp"
#include "core/solver/touch_terms.hpp"

namespace hairnet {

const Environment kCalmEnvironment{};
const Vec3 kDesignGravity{0, -kGravity_m_per_s2, 0};

namespace {

// Copies nodes of three floats into a single character's layout of `stride` floats a node; gather() copies back.
void spread(const std::vector<Vec3f>& nodes, std::size_t stride, float* out) {
  HAIRNET_ASSERT(stride == 3 || stride == 4);
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    std::memcpy(out + i * stride, nodes[i].data(), sizeof(Vec3f));
    if (stride > 3) out[i * stride + 3] = 0;
  }
}
void gather(const float* in, std::size_t stride, std::vector<Vec3f>& nodes) {
  for (std::size_t i = 0; i < nodes.size(); ++i) std::memcpy(nodes[i].data(), in + i * stride, sizeof(Vec3f));
}

// Stores the terms of bodies and holds. A Real of a single character is one float in memory, so the terms are copied as
// they are.
void put_touch(const Level& level, const StepInput& input, const LaneMemory& memory) {
  if (!input.touch) return;
  float* bodies = memory.bodies;
  for (const StepBody& body : input.touch->bodies) {
    const BodyTerms terms = body_terms(input, body);
    std::memcpy(bodies, &terms, sizeof terms);
    bodies += kBodyTermCount;
  }
  float* holds = memory.holds;
  for (const StepHold& hold : input.touch->holds) {
    HAIRNET_ASSERT(hold.point < level.contacts.count());
    const HoldTerms terms = hold_terms(input, hold);
    std::memcpy(holds, &terms, sizeof terms);
    holds += kHoldTermCount;
  }
}

[[maybe_unused]] bool is_within_bound(const std::vector<Vec3f>& displacement, float max_m) {
  constexpr float kRounding = 1e-4f;
  return std::ranges::all_of(displacement, [&](const Vec3f& d) { return d.norm() <= max_m * (1 + kRounding); });
}

}  // namespace

int substep_count_for(double tick_s) {
  HAIRNET_ASSERT(tick_s > 0);
  // A tick of exactly n longest steps must not become n + 1 steps because the quotient is rounded up.
  constexpr double kRounding = 1e-9;
  const double count = std::ceil(tick_s / kStepMax_s - kRounding);
  HAIRNET_ASSERT(count <= std::numeric_limits<int>::max());
  return std::max(1, static_cast<int>(count));
}

int iterations_for(LevelIndex level, double step_s) {
  HAIRNET_ASSERT(static_cast<std::size_t>(level) < kLevelIterations.size());
  HAIRNET_ASSERT(step_s > 0);
  constexpr double kRounding = 1e-9;
  const int longest = kLevelIterations[static_cast<std::size_t>(level)];
  return static_cast<int>(std::ceil(longest * step_s / kStepMax_s - kRounding));
}

bool step(const Level& level, const StepInput& input, const SolverSettings& settings, StepScratch& scratch,
          LatticeState& state) {
  HAIRNET_ASSERT(state.displacement.size() == level.rest.size());
  HAIRNET_ASSERT(state.velocity.size() == level.rest.size());
  HAIRNET_ASSERT(input.environment);
  const LaneSizes sizes = single_sizes();
  // The view is made again in each step: the scratch may have served another level since, and a view costs one
  // pass over the springs, where a step makes dozens.
  const LevelView level_view = make_view(
      level, {.wind = input.environment->wind.acts(), .bodies = body_count(input), .holds = hold_count(input)},
      scratch.view);
  const LaneMemory memory = scratch.lanes.allocate(sizes, level_view);
  const StepTerms terms = step_terms(level, input, state);
  std::memcpy(scratch.lanes.terms(), &terms, sizeof terms);
  put_touch(level, input, memory);
  spread(state.displacement, sizes.vector, memory.displacement);
  spread(state.velocity, sizes.vector, memory.velocity);
  single_kernel(level_view, memory, settings.iterations);
  gather(memory.displacement, sizes.vector, state.displacement);
  gather(memory.velocity, sizes.vector, state.velocity);
  state.elastic_energy_max_j = *memory.elastic_energy_max_j;
  state.speed_max_m_per_s = *memory.speed_max;
  const bool is_finite = *memory.is_finite != 0;
  HAIRNET_ASSERT(!is_finite || state.speed_max_m_per_s >= 0);
  HAIRNET_VALIDATE(!is_finite || is_within_bound(state.displacement, level.displacement_max_m));
  return is_finite;
}

void reset_to_rest(const Level& level, LatticeState& state) {
  state.displacement.assign(level.rest.size(), Vec3f::Zero());
  state.velocity.assign(level.rest.size(), Vec3f::Zero());
  // There was no step yet, so nothing says how much energy is too much.
  state.elastic_energy_max_j = std::numeric_limits<float>::infinity();
  state.speed_max_m_per_s = 0;
}

}  // namespace hairnet
