#include "core/world/character.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace hairnet {
namespace {

// Bones closer to each other than this are as good as still: less than a headset's noise.
constexpr double kStillShift_m = 3e-4;
constexpr double kStillTurn_rad = 1e-3;
constexpr float kStillSpeed_m_per_s = 1e-3f;

bool is_still(const Pose& a, const Pose& b) {
  static const double kTurnCosine = std::cos(kStillTurn_rad / 2);
  for (std::size_t i = 0; i < kBoneCount; ++i) {
    if ((a.bones[i].position - b.bones[i].position).squaredNorm() > kStillShift_m * kStillShift_m) return false;
    if (std::abs(a.bones[i].rotation.dot(b.bones[i].rotation)) < kTurnCosine) return false;
  }
  return true;
}

// What has come in of springs, attachments and contact since a switch of levels. They begin weak, not absent, so that
// hair hardly sinks meanwhile.
struct SwitchEase {
  explicit SwitchEase(double since_s) : t(std::clamp(since_s / kSwitchEase_s, 0.0, 1.0)) {}
  [[nodiscard]] double stiffness() const { return 0.1 + 0.9 * t * t; }
  [[nodiscard]] double contact() const { return 0.02 + 0.98 * t * t; }
  double t;
};

// The displacements shrink along a smooth curve to none, where the rigid level begins.
void ease_to_rigid(double tick_s, Character& c) {
  const auto left = [](double elapsed_s) {
    const double t = std::clamp(elapsed_s / kRigidEase_s, 0.0, 1.0);
    return 1 - t * t * (3 - 2 * t);
  };
  const double before = left(c.easing_s);
  c.easing_s += tick_s;
  const double after = left(c.easing_s);
  if (after <= 0) {
    c.level = LevelIndex::rigid;
    c.state = {};
    c.easing_s = -1;
    return;
  }
  for (Vec3f& d : c.state.displacement) d *= static_cast<float>(after / before);
}

// Springs and contact as calm and a switch of levels leave them.
void ease_in(const TickTerms& terms, double calm_release, Character& c) {
  const bool is_still_air = terms.environment->wind.is_still();
  c.contact_release = std::max(is_still_air ? calm_release : 0, 1 - SwitchEase(c.switched_s).contact());
  c.switched_s += terms.tick_s;
  const double stiffness = SwitchEase(c.switched_s).stiffness() * (is_still_air ? c.calm_release.stiffness() : 1);
  c.state.elastic_energy_max_j *= static_cast<float>(stiffness / std::exchange(c.stiffness, stiffness));
}

// Counts towards sleep while no node moves against the head.
void count_stillness(double tick_s, Character& c) {
  if (c.state.speed_max_m_per_s > kStillSpeed_m_per_s) return c.wake();
  c.still_s += tick_s;
  if (!c.is_asleep()) return;
  for (Vec3f& v : c.state.velocity) v.setZero();
  c.last_from = c.from;
}

}  // namespace

Outcome begin_tick(const TickTerms& terms, Character& c) {
  const bool jumped = std::exchange(c.teleport, false) || is_teleport(c.from, c.to, terms.tick_s);
  if (jumped || !terms.environment->wind.is_still() || !is_still(c.still_pose, c.to)) {
    c.wake();
    c.still_pose = c.to;
  }
  if (c.is_asleep()) return Outcome::asleep;
  const double calm_release = c.calm_release.update(c.to, terms.tick_s);
  Outcome outcome = Outcome::idle;
  if (c.easing_s >= 0) {
    ease_to_rigid(terms.tick_s, c);
    outcome = Outcome::eased;
  } else if (jumped) {
    outcome = Outcome::teleported;
  } else if (c.model()) {
    ease_in(terms, calm_release, c);
    return Outcome::stepped;
  }
  c.last_from = jumped ? c.to : interpolate(c.from, c.to, (terms.substep_count - 1.0) / terms.substep_count);
  c.from = c.to;
  if (outcome == Outcome::idle) c.still_s += terms.tick_s;
  return outcome;
}

void put_inputs(const TickTerms& terms, const Character& c, std::span<StepInput> inputs) {
  for (std::size_t s = 0; s < inputs.size(); ++s) {
    StepInput& input = inputs[s];
    const double share = static_cast<double>(s + 1) / static_cast<double>(inputs.size());
    input.from = s == 0 ? c.from : inputs[s - 1].to;
    input.to = s + 1 == inputs.size() ? c.to : interpolate(c.from, c.to, share);
    input.step_s = terms.substep_s();
    input.environment = *terms.environment;
    input.contact_release = c.contact_release;
    input.material = c.material;
    input.material.stiffness *= static_cast<float>(c.stiffness);
    input.time_s = (static_cast<double>(terms.tick) + share) * terms.tick_s;
  }
}

Outcome end_tick(const TickTerms& terms, std::span<const StepInput> inputs, bool is_finite, Character& c) {
  c.last_from = inputs.back().from;
  c.from = c.to;
  if (!is_finite) {
    reset_to_rest(*c.model(), c.state);
    return Outcome::reset;
  }
  count_stillness(terms.tick_s, c);
  return Outcome::stepped;
}

}  // namespace hairnet
