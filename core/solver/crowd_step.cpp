#include "core/solver/crowd_step.hpp"

#include <algorithm>
#include <array>
#include <cstring>

#include "core/assert.hpp"
#include "core/solver/kernels.hpp"
#include "core/solver/step_terms.hpp"
#include "core/solver/touch_terms.hpp"

namespace hairnet {
namespace {

// A register of AVX-512 has sixteen floats; kernels.cpp uses no more of a wider one.
constexpr std::size_t kCrowdWidthMax = 16;

// Puts one character's terms into its lane: number f of the struct is lane `lane` of Real f.
template <class Terms>
void put_terms(const Terms& terms, std::size_t lane, std::size_t width, float* lanes) {
  HAIRNET_ASSERT(lane < width);
  std::array<float, sizeof(Terms) / sizeof(float)> floats;
  std::memcpy(floats.data(), &terms, sizeof terms);
  for (std::size_t f = 0; f < floats.size(); ++f) lanes[f * width + lane] = floats[f];
}

// The most bodies of any member in any substep; all lanes have memory for so many.
std::size_t bodies_at_most(std::span<CrowdMember* const> members) {
  std::size_t most = 0;
  for (const CrowdMember* member : members) {
    for (const StepInput& input : member->inputs) most = std::max(most, body_count(input));
  }
  return most;
}

bool is_held(const CrowdMember& member) {
  return std::ranges::any_of(member.inputs, [](const StepInput& input) { return hold_count(input) > 0; });
}

void step_alone(const Level& level, const SolverSettings& settings, StepScratch& scratch, CrowdMember& member) {
  for (const StepInput& input : member.inputs) {
    member.is_finite = step(level, input, settings, scratch, *member.state) && member.is_finite;
  }
}

bool is_windy(std::span<CrowdMember* const> members) {
  return std::ranges::any_of(members, [](const CrowdMember* member) {
    return std::ranges::any_of(member->inputs, [](const StepInput& i) { return i.environment->wind.acts(); });
  });
}

// Whether two members have the same state, to which two lanes would write.
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

// The lanes of one call: loads the states once, takes all steps, and stores the states once, since turning characters
// into lanes moves every number of every state.
class Lanes {
 public:
  Lanes(const Level& level, std::span<CrowdMember* const> members, StepScratch& scratch)
      : level_(level),
        members_(members),
        width_(crowd_width()),
        view_(make_view(level, {.wind = is_windy(members), .crowd = true, .bodies = bodies_at_most(members)},
                        scratch.view)),
        memory_(scratch.lanes.allocate(crowd_sizes(), view_)),
        terms_(scratch.lanes.terms()) {}

  // Copies the states of all members into the lanes.
  void load() {
    exchange([](LatticeState& s) { return s.displacement.data()->data(); },
             [&](float** at, std::size_t floats) { to_lanes(at, members_.size(), floats, memory_.displacement); });
    exchange([](LatticeState& s) { return s.velocity.data()->data(); },
             [&](float** at, std::size_t floats) { to_lanes(at, members_.size(), floats, memory_.velocity); });
  }

  // Takes substep `index` of all members.
  void step(std::size_t index, int iterations) {
    for (std::size_t l = 0; l < members_.size(); ++l) {
      put_terms(step_terms(level_, members_[l]->inputs[index], *members_[l]->state), l, width_, terms_);
    }
    // A lane without a character computes too. Default terms and a state of zeros keep its numbers finite, and no lane
    // reads another.
    for (std::size_t l = members_.size(); l < width_; ++l) put_terms(StepTerms(), l, width_, terms_);
    put_bodies(index);
    crowd_kernel(view_, memory_, iterations);
    for (std::size_t l = 0; l < members_.size(); ++l) {
      // The terms of the next step read the energy limit from the state, so these results leave the lanes after every
      // step.
      members_[l]->state->elastic_energy_max_j = memory_.elastic_energy_max_j[l];
      members_[l]->state->speed_max_m_per_s = memory_.speed_max[l];
      members_[l]->is_finite = members_[l]->is_finite && memory_.is_finite[l] != 0;
    }
  }

  // Copies the states back. Results such as is_finite are stored by step().
  void store() {
    exchange([](LatticeState& s) { return s.displacement.data()->data(); },
             [&](float** at, std::size_t floats) { from_lanes(memory_.displacement, floats, at, members_.size()); });
    exchange([](LatticeState& s) { return s.velocity.data()->data(); },
             [&](float** at, std::size_t floats) { from_lanes(memory_.velocity, floats, at, members_.size()); });
  }

 private:
  // Puts the bodies of substep `index` into their lanes. The batch loops over as many bodies as its most touched member
  // has. Other members get bodies whose surface no hair reaches (BodyTerms).
  void put_bodies(std::size_t index) {
    for (std::size_t b = 0; b < view_.body_count; ++b) {
      float* at = memory_.bodies + b * kBodyTermCount * width_;
      for (std::size_t l = 0; l < width_; ++l) {
        const StepInput* input = l < members_.size() ? &members_[l]->inputs[index] : nullptr;
        const bool is_there = input && b < body_count(*input);
        put_terms(is_there ? body_terms(*input, input->touch->bodies[b]) : BodyTerms(), l, width_, at);
      }
    }
  }

  template <class Array, class Move>
  void exchange(Array array_of, Move move) {
    std::array<float*, kCrowdWidthMax> at{};
    for (std::size_t l = 0; l < members_.size(); ++l) at[l] = array_of(*members_[l]->state);
    move(at.data(), 3 * view_.node_count);
  }

  const Level& level_;
  std::span<CrowdMember* const> members_;
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
  std::array<CrowdMember*, kCrowdWidthMax> free{};
  std::size_t free_count = 0;
  for (CrowdMember& member : members) {
    // Held points differ from character to character, so in lanes their nodes would have to be gathered.
    if (is_held(member)) {
      step_alone(level, settings, scratch, member);
    } else {
      free[free_count++] = &member;
    }
  }
  if (free_count == 0) return;
  Lanes lanes(level, std::span(free).first(free_count), scratch);
  lanes.load();
  for (std::size_t index = 0; index < members.front().inputs.size(); ++index) lanes.step(index, settings.iterations);
  lanes.store();
}

}  // namespace hairnet
