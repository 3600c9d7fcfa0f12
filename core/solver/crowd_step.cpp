#include "core/solver/crowd_step.hpp"

#include <algorithm>
#include <array>
#include <cstring>

#include "core/assert.hpp"
#include "core/solver/kernels.hpp"
#include "core/solver/step_terms.hpp"

namespace hairnet {
namespace {

constexpr std::size_t kCrowdWidthMax = 16;

void put_terms(const StepTerms& terms, std::size_t lane, std::size_t width, float* lanes) {
  HAIRNET_ASSERT(lane < width);
  std::array<float, kStepTermCount> floats;
  std::memcpy(floats.data(), &terms, sizeof terms);
  for (std::size_t f = 0; f < kStepTermCount; ++f) lanes[f * width + lane] = floats[f];
}

bool is_windy(std::span<const CrowdMember> members) {
  return std::ranges::any_of(members, [](const CrowdMember& member) {
    return std::ranges::any_of(member.inputs, [](const StepInput& i) { return i.environment->wind.acts(); });
  });
}

// Whether a state appears twice: then two lanes would write to it.
[[maybe_unused]] bool has_shared_state(std::span<const CrowdMember> members) {
  for (std::size_t a = 0; a < members.size(); ++a) {
    for (std::size_t b = 0; b < a; ++b) {
      if (members[a].state == members[b].state) return true;
    }
  }
  return false;
}

void check_member(const Level& level, const CrowdMember& member, std::size_t step_count) {
  HAIRNET_ASSERT(member.state);
  HAIRNET_ASSERT(member.state->displacement.size() == level.rest.size());
  HAIRNET_ASSERT(member.state->velocity.size() == level.rest.size());
  HAIRNET_ASSERT(member.inputs.size() == step_count);
  for (const StepInput& input : member.inputs) HAIRNET_ASSERT(input.environment);
}

class Lanes {
 public:
  Lanes(const Level& level, std::span<CrowdMember> members, StepScratch& scratch)
      : level_(level),
        members_(members),
        width_(crowd_width()),
        view_(make_view(level, {.wind = is_windy(members), .crowd = true}, scratch.view)),
        memory_(scratch.lanes.allocate(crowd_sizes(), view_)),
        terms_(scratch.lanes.terms()) {}

  void load() {
    exchange([](LatticeState& s) { return s.displacement.data()->data(); },
             [&](float** at, std::size_t floats) { to_lanes(at, members_.size(), floats, memory_.displacement); });
    exchange([](LatticeState& s) { return s.velocity.data()->data(); },
             [&](float** at, std::size_t floats) { to_lanes(at, members_.size(), floats, memory_.velocity); });
  }

  void step(std::size_t index, int iterations) {
    for (std::size_t l = 0; l < members_.size(); ++l) {
      put_terms(step_terms(level_, members_[l].inputs[index], *members_[l].state), l, width_, terms_);
    }
    for (std::size_t l = members_.size(); l < width_; ++l) put_terms({}, l, width_, terms_);
    crowd_kernel(view_, memory_, iterations);
    for (std::size_t l = 0; l < members_.size(); ++l) {
      members_[l].state->elastic_energy_max_j = memory_.elastic_energy_max_j[l];
      members_[l].state->speed_max_m_per_s = memory_.speed_max[l];
      members_[l].is_finite = members_[l].is_finite && memory_.is_finite[l] != 0;
    }
  }

  void store() {
    exchange([](LatticeState& s) { return s.displacement.data()->data(); },
             [&](float** at, std::size_t floats) { from_lanes(memory_.displacement, floats, at, members_.size()); });
    exchange([](LatticeState& s) { return s.velocity.data()->data(); },
             [&](float** at, std::size_t floats) { from_lanes(memory_.velocity, floats, at, members_.size()); });
  }

 private:
  template <class Array, class Move>
  void exchange(Array array_of, Move move) {
    std::array<float*, kCrowdWidthMax> at{};
    for (std::size_t l = 0; l < members_.size(); ++l) at[l] = array_of(*members_[l].state);
    move(at.data(), 3 * view_.node_count);
  }

  const Level& level_;
  std::span<CrowdMember> members_;
  std::size_t width_;
  LevelView view_;
  LaneMemory memory_;
  float* terms_;
};

}  // namespace

std::size_t crowd_width() {
  const std::size_t width = crowd_sizes().real;
  HAIRNET_ASSERT(width >= 1);
  HAIRNET_ASSERT(width <= kCrowdWidthMax);
  return width;
}

std::size_t crowd_count_min() {
  return crowd_width() >= 16 ? 3 : std::min<std::size_t>(crowd_width(), 2);
}

void step_crowd(const Level& level, std::span<CrowdMember> members, const SolverSettings& settings,
                StepScratch& scratch) {
  HAIRNET_ASSERT(members.size() <= crowd_width());
  HAIRNET_ASSERT(settings.iterations >= 0);
  if (members.empty()) return;
  for (CrowdMember& member : members) {
    check_member(level, member, members.front().inputs.size());
    member.is_finite = true;
  }
  HAIRNET_VALIDATE(!has_shared_state(members));
  Lanes lanes(level, members, scratch);
  lanes.load();
  for (std::size_t index = 0; index < members.front().inputs.size(); ++index) lanes.step(index, settings.iterations);
  lanes.store();
}

}  // namespace hairnet
