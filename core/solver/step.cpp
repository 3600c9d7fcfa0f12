#include "core/solver/step.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "core/assert.hpp"
#include "core/solver/kernels.hpp"
#include "core/solver/step_terms.hpp"

namespace hairnet {
namespace {

// Copies between a node's three floats and its place in a single character's layout.
void spread(const std::vector<Vec3f>& nodes, std::size_t stride, float* out) {
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    std::memcpy(out + i * stride, nodes[i].data(), sizeof(Vec3f));
    if (stride > 3) out[i * stride + 3] = 0;
  }
}
void gather(const float* in, std::size_t stride, std::vector<Vec3f>& nodes) {
  for (std::size_t i = 0; i < nodes.size(); ++i) std::memcpy(nodes[i].data(), in + i * stride, sizeof(Vec3f));
}

}  // namespace

int substep_count_for(double tick_s) {
  constexpr double kRounding = 1e-9;
  return std::max(1, static_cast<int>(std::ceil(tick_s / kStepMax_s - kRounding)));
}

int iterations_for(LevelIndex level, double step_s) {
  constexpr double kRounding = 1e-9;
  const int longest = kLevelIterations[static_cast<std::size_t>(level)];
  return static_cast<int>(std::ceil(longest * step_s / kStepMax_s - kRounding));
}

bool step(const Level& level, const StepInput& input, const SolverSettings& settings, StepScratch& scratch,
          LatticeState& state) {
  HAIRNET_ASSERT(state.displacement.size() == level.rest.size() && state.velocity.size() == level.rest.size());
  const LaneSizes sizes = single_sizes();
  const LevelView level_view = make_view(level, {.wind = !input.environment->wind.is_still()}, scratch.view);
  const LaneMemory memory = scratch.lanes.allocate(sizes, level_view);
  const StepTerms terms = step_terms(level, input, state);
  std::memcpy(scratch.lanes.terms(), &terms, sizeof terms);
  spread(state.displacement, sizes.vector, memory.displacement);
  spread(state.velocity, sizes.vector, memory.velocity);
  single_kernel(level_view, memory, settings.iterations);
  gather(memory.displacement, sizes.vector, state.displacement);
  gather(memory.velocity, sizes.vector, state.velocity);
  state.elastic_energy_max_j = *memory.elastic_energy_max_j;
  state.speed_max_m_per_s = *memory.speed_max;
  return *memory.is_finite != 0;
}

void reset_to_rest(const Level& level, LatticeState& state) {
  state.displacement.assign(level.rest.size(), Vec3f::Zero());
  state.velocity.assign(level.rest.size(), Vec3f::Zero());
  state.elastic_energy_max_j = std::numeric_limits<float>::infinity();
  state.speed_max_m_per_s = 0;
}

}  // namespace hairnet
