#include "core/learnt/learnt_hair.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "core/assert.hpp"
#include "core/learnt/learnt_kernel.hpp"

namespace hairnet {
namespace {

// An input that was at most this many times its greatest size in training counts as covered.
constexpr float kMargin = 1.1f;

}  // namespace

bool LearntHair::covers(const PoseInputs& inputs) const {
  for (std::size_t i = 0; i < inputs.size(); ++i)
    // Written so that NaN is not covered.
    if (!(std::abs(inputs[i]) <= kMargin * most[i])) return false;
  return true;
}

bool LearntHair::covers_air(double speed_m_per_s) const {
  return speed_m_per_s == 0 || (!wind.weights.empty() && speed_m_per_s <= double{kMargin} * double{wind.max_m_per_s});
}

std::size_t LearntHair::bytes() const {
  return sizeof(float) *
         (input_weights.size() + hidden_weights.size() + bias.size() + output_weights.size() + wind.weights.size());
}

std::string validate(const LearntHair& hair) {
  const auto is_count = [](std::size_t count, std::size_t most) {
    return count > 0 && count <= most && count % 4 == 0;
  };
  if (!is_count(hair.hidden_count, kLearntHiddenMax)) return "learnt hair with a wrong number of hidden numbers";
  if (!is_count(hair.mode_count, kLearntModesMax)) return "learnt hair with a wrong number of modes";
  const std::size_t gates = 3 * hair.hidden_count;
  if (hair.input_weights.size() != gates * kPoseInputCount || hair.hidden_weights.size() != gates * hair.hidden_count ||
      hair.bias.size() != gates || hair.output_weights.size() != hair.mode_count * hair.hidden_count ||
      (!hair.wind.weights.empty() && hair.wind.weights.size() != gates * kAirInputCount)) {
    return "learnt hair with a wrong number of weights";
  }
  for (const auto* numbers :
       {&hair.input_weights, &hair.hidden_weights, &hair.bias, &hair.output_weights, &hair.wind.weights})
    // Learnt hair comes from files and from peers. Sums of weights within this limit stay finite.
    if (!std::ranges::all_of(*numbers, [](float v) { return std::abs(v) <= kLearntWeightMax; }))
      return "learnt hair with a weight that is not finite, or too great";
  const auto is_size = [](float value) { return std::isfinite(value) && value >= 0; };
  if (!std::ranges::all_of(hair.most, is_size) || !is_size(hair.wind.max_m_per_s))
    return "learnt hair with a wrong range of inputs";
  for (const float error : {hair.error, hair.low_error, hair.wind.error, hair.wind.low_error})
    if (!is_size(error)) return "learnt hair with a wrong error";
  return {};
}

void step_learnt(const LearntHair& hair, std::span<LearntMember> members) {
  HAIRNET_ASSERT(members.size() <= kLearntWidth);
  HAIRNET_VALIDATE(validate(hair).empty());
  // [number][character]
  alignas(64) std::array<float, (kPoseInputCount + kAirInputCount) * kLearntWidth> inputs{};
  // Lanes without a character compute on zeros.
  alignas(64) std::array<float, kLearntHiddenMax * kLearntWidth> before{}, after;
  alignas(64) std::array<float, kLearntModesMax * kLearntWidth> coefficients;
  for (std::size_t m = 0; m < members.size(); ++m) {
    LearntMember& member = members[m];
    HAIRNET_ASSERT(member.state);
    HAIRNET_ASSERT(member.pose);
    HAIRNET_ASSERT(member.coefficients.size() >= hair.mode_count);
    const PoseInputs own = member.state->poses.next(*member.pose, member.air_is_carried);
    const Vec3f air = (member.pose->head().rotation.conjugate() * member.air_world).cast<float>();
    member.is_covered = hair.covers(own) && hair.covers_air(member.air_world.norm());
    for (std::size_t i = 0; i < own.size(); ++i) inputs[i * kLearntWidth + m] = own[i];
    for (std::size_t i = 0; i < kAirInputCount; ++i)
      inputs[(kPoseInputCount + i) * kLearntWidth + m] = air[static_cast<int>(i)];
    std::vector<float>& hidden = member.state->hidden;
    hidden.resize(hair.hidden_count);
    for (std::size_t i = 0; i < hidden.size(); ++i) before[i * kLearntWidth + m] = hidden[i];
  }
  learnt_kernel(hair, inputs.data(), before.data(), after.data(), coefficients.data());
  for (std::size_t m = 0; m < members.size(); ++m) {
    std::vector<float>& hidden = members[m].state->hidden;
    for (std::size_t i = 0; i < hidden.size(); ++i) hidden[i] = after[i * kLearntWidth + m];
    const std::span<float> out = members[m].coefficients;
    for (std::size_t k = 0; k < hair.mode_count; ++k) out[k] = coefficients[k * kLearntWidth + m];
    // A basis may have more modes than the network drives.
    std::ranges::fill(out.subspan(hair.mode_count), 0.0f);
  }
}

void step_learnt(const LearntHair& hair, std::span<LearntMotion> motions) {
  HAIRNET_ASSERT(motions.size() <= kLearntWidth);
  int first = 1, last = 0;
  for (LearntMotion& motion : motions) {
    HAIRNET_ASSERT(motion.ticks >= 0);
    HAIRNET_ASSERT(motion.air_world.empty() || motion.air_world.size() == static_cast<std::size_t>(motion.ticks) + 1);
    motion.is_covered = true;
    if (motion.begins) first = 1 - kLearntStart_ticks;
    last = std::max(last, motion.ticks);
  }
  std::array<Pose, kLearntWidth> poses;
  std::array<LearntMember, kLearntWidth> members;
  std::array<LearntMotion*, kLearntWidth> stepped;
  // Up to tick 0 the first pose is held.
  for (int tick = first; tick <= last; ++tick) {
    std::size_t count = 0;
    for (LearntMotion& motion : motions) {
      if (tick > 0 ? tick > motion.ticks : !motion.begins) continue;
      Pose& pose = poses[count];
      if (tick <= 0)
        pose = *motion.from;
      else if (tick == motion.ticks)
        pose = *motion.to;
      else
        pose = interpolate(*motion.from, *motion.to, static_cast<double>(tick) / motion.ticks);
      members[count] = {.state = motion.state,
                        .pose = &pose,
                        .coefficients = motion.coefficients,
                        .air_is_carried = motion.air_is_carried};
      if (!motion.air_world.empty())
        members[count].air_world = motion.air_world[static_cast<std::size_t>(std::max(tick, 0))];
      stepped[count++] = &motion;
    }
    step_learnt(hair, std::span(members).first(count));
    for (std::size_t m = 0; m < count; ++m)
      stepped[m]->is_covered = stepped[m]->is_covered && (tick <= 0 || members[m].is_covered);
  }
}

}  // namespace hairnet
