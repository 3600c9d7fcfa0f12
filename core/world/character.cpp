#include "core/world/character.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "core/assert.hpp"
#include "core/smoothstep.hpp"
#include "core/world/rigid_velocity.hpp"
#include "core/world/stillness.hpp"

namespace hairnet {
namespace {

// Hair counts as still while no node is faster than this relative to the head.
constexpr float kStillSpeed_m_per_s = 1e-3f;
// Hair that settles loses half of its velocity in this time.
constexpr double kSettleHalf_s = 1.0 / 15;
// Hair that sticks goes half as far in a turn after each such time. Friction is a viscosity here (body_contact.hpp), so
// hair that lies on something would otherwise creep without end.
constexpr double kStickHalf_s = 0.5;
// Untouched hair sticks after it has settled for this long. Only the own body can hold such hair up, and most of it has
// glided off by then. Touched hair sticks as soon as it settles.
constexpr double kStickAfter_s = 4;

// A state from outside may exceed the level's farthest displacement by this much, because the wire's coarsest step
// (kHairStateStepMax_m) may have rounded each coordinate.
constexpr float kStateSlack_m = 0.002f;
// A state from outside with faster nodes is refused. Hair within a metre of a head moves hardly faster than the head
// (is_teleport).
constexpr float kStateSpeedMax_m_per_s = 1000;
// Faster hair was on a ride. Its velocities are dropped, since the head of the new character may stand still. It is the
// speed above which is_teleport() asks whether a head rides or jumps.
constexpr float kStateRideSpeed_m_per_s = 25;

// Whether no bone has moved or turned by more than a headset's noise.
bool is_still(const Pose& a, const Pose& b) {
  return std::ranges::equal(a.bones, b.bones,
                            [](const auto& bone, const auto& other) { return is_still(bone, other); });
}

// The effective shares of springs, attachments and contact after a level switch. They begin at 10 % and 2 %, and not at
// 0, so that hair hardly sinks meanwhile. They grow with the square of the time.
struct SwitchEase {
  explicit SwitchEase(double since_s) : t(std::clamp(since_s / kSwitchEase_s, 0.0, 1.0)) {}
  [[nodiscard]] double stiffness() const { return 0.1 + 0.9 * t * t; }
  [[nodiscard]] double contact() const { return 0.02 + 0.98 * t * t; }
  double t;
};

// Reduces the displacements along a smooth curve. When they are zero, the rigid level begins.
void ease_to_rigid(double elapsed_s, Character& c) {
  // The share of the displacements that is left this long after the request.
  const auto left = [](double since_s) { return 1 - smoothstep(0.0, kRigidEase_s, since_s); };
  const double before = left(c.rigid_ease_s);
  HAIRNET_ASSERT(before > 0);
  c.rigid_ease_s += elapsed_s;
  const double after = left(c.rigid_ease_s);
  if (after <= 0) {
    c.level = LevelIndex::rigid;
    c.state = {};
    c.rigid_ease_s = -1;
    return;
  }
  for (Vec3f& d : c.state.displacement) d *= static_cast<float>(after / before);
}

// How long bones and air have been at rest, s. Any wind counts as motion.
double still_s(const TickContext& terms, const Character& c) {
  return terms.environment(c).wind.is_still() ? c.bones_still_s : 0;
}

double settle_after_s(const Character& c) {
  return c.touch ? kSettleTouchedAfter_s : kSettleAfter_s;
}

// Sets the shares of springs and contact after level switches and untangling.
void ease_in(const TickContext& terms, Character& c) {
  const double elapsed_s = terms.plan(c).interval_s;
  // Hair that lies on a prop, or is held, may be folded for any time, so touched hair is never untangled.
  const double free_still_s = c.touch ? 0 : still_s(terms, c);
  c.untangle.update(c.to, free_still_s, elapsed_s, *c.model(), c.state.displacement);
  c.contact_release = std::max(c.untangle.share(), 1 - SwitchEase(c.since_switch_s).contact());
  c.since_switch_s += elapsed_s;
  const double stiffness = std::min(c.untangle.stiffness(), SwitchEase(c.since_switch_s).stiffness());
  // The elastic energy of springs and attachments is proportional to their stiffness, so the limit changes by the same
  // factor.
  c.state.elastic_energy_max_j *= static_cast<float>(stiffness / std::exchange(c.stiffness, stiffness));
}

// Counts the time towards sleep while no node moves against the head. When the character falls asleep, all motion ends.
void count_stillness(double elapsed_s, Character& c) {
  if (c.state.speed_max_m_per_s > kStillSpeed_m_per_s) return c.wake();
  c.still_s += elapsed_s;
  if (!c.is_asleep()) return;
  for (Vec3f& v : c.state.velocity) v.setZero();
  c.last_from = c.from;
  c.unsettled = {};
}

// Ends motion that leads nowhere, long after bones and air have come to rest. Springs that turn far in one linearised
// step can keep a lattice in an endless cycle. The limit of elastic energy, which scales a lattice back before each
// step, can leave it with a velocity without effect. Light nodes may swing on and on.
//
// Therefore each turn goes only half its way, and velocities are damped. This ends all such motion and changes no state
// of rest. After kStickAfter_s the turn goes a smaller and smaller share, so hair that still creeps sticks where it is.
void settle(const TickContext& terms, Character& c) {
  const double settling_s = still_s(terms, c) - settle_after_s(c);
  if (settling_s < 0) return;
  // How long the hair has been sticking, s, negative before; and the share of its way that is left to it.
  const double stuck_s = settling_s - (c.touch ? 0 : kStickAfter_s);
  const double stuck = std::exp2(-std::max(0.0, stuck_s) / kStickHalf_s);
  const auto share = static_cast<float>(0.5 * stuck);
  const auto damping = static_cast<float>(std::exp2(-terms.plan(c).interval_s / kSettleHalf_s));
  HAIRNET_ASSERT(c.unsettled.displacement.size() == c.state.displacement.size());
  float farthest2_m2 = 0;
  for (std::size_t i = 0; i < c.state.displacement.size(); ++i) {
    Vec3f &d = c.state.displacement[i], &v = c.state.velocity[i];
    const Vec3f way = d - c.unsettled.displacement[i];
    d = c.unsettled.displacement[i] + share * way;
    v *= damping;
    farthest2_m2 = std::max(farthest2_m2, way.squaredNorm());
  }
  c.state.speed_max_m_per_s = static_cast<float>(stuck / terms.plan(c).interval_s) * std::sqrt(farthest2_m2);
}

// Whether the character has a turn in this tick.
bool is_due(const TickContext& terms, const Character& c) {
  // The phase is the slot's number, so the characters of one stride have their turns in different ticks.
  return c.steps_next_tick || (terms.tick + c.phase) % c.stride == 0;
}

// Ends the turn of a character whose lattice is not stepped: rigid, learnt, easing or teleported.
void end_turn(const TickContext& terms, Character& c) {
  // A lattice that comes next reads the head's velocity from last_from and from, as after a last substep.
  const double steps = terms.plan(c).substep_count;
  c.last_from = c.discontinuous ? c.to : interpolate(c.from, c.to, (steps - 1) / steps);
  c.from = c.to;
  c.velocity_is_relative = c.discontinuous;
}

// Takes the rigid velocity out of the state's velocities, because a jump of the head must not throw the hair. The
// head's velocity after the jump is known only when the next pose has come.
void make_velocity_relative(Character& c) {
  if (c.model() && !c.velocity_is_relative) add_rigid_velocity(*c.model(), last_head_motion(c), -1, c.state);
  c.last_from = c.from;
  c.velocity_is_relative = true;
}

// Adds the rigid velocity over the coming first substep, in the axes of the head at its start, as the solver's input
// has it.
void add_next_rigid_velocity(const StepPlan& plan, Character& c) {
  const Pose first = interpolate(c.from, c.to, 1.0 / plan.substep_count);
  const RigidTransform motion = c.from.head().inverse() * first.head();
  const Level& level = *c.model();
  for (std::size_t i = 0; i < level.rest.size(); ++i) {
    const Vec3 rest = level.rest[i].cast<double>();
    c.state.velocity[i] += ((motion.point(rest) - rest) / plan.substep_s()).cast<float>();
  }
}

}  // namespace

void check_invariants(const Character& c) {
  const Level* model = c.model();
  HAIRNET_ASSERT(c.level == LevelIndex::rigid || c.levels);
  HAIRNET_ASSERT(c.level != LevelIndex::learnt || c.network());
  HAIRNET_ASSERT(c.learnt.coefficients.size() == (c.network() ? c.network()->mode_count : 0));
  HAIRNET_ASSERT(c.state.displacement.size() == (model ? model->rest.size() : 0));
  HAIRNET_ASSERT(c.state.velocity.size() == c.state.displacement.size());
  HAIRNET_ASSERT(c.rigid_ease_s < kRigidEase_s);
  // Only a lattice eases.
  HAIRNET_ASSERT(c.rigid_ease_s < 0 || model);
  HAIRNET_ASSERT(c.stiffness > 0);
  HAIRNET_ASSERT(c.stiffness <= 1);
  HAIRNET_ASSERT(c.contact_release >= 0);
  HAIRNET_ASSERT(c.contact_release <= 1);
  HAIRNET_ASSERT(c.bones_still_s >= 0);
  HAIRNET_ASSERT(c.still_s >= 0);
  HAIRNET_ASSERT(c.last_step_s > 0);
  HAIRNET_ASSERT(c.stride == 1 || c.stride == 2 || c.stride == kStrideMax);
  HAIRNET_ASSERT(c.step_ticks >= 1);
  HAIRNET_ASSERT(c.step_ticks <= kStrideMax);
  HAIRNET_ASSERT(c.changed_tick == kNeverChanged || c.changed_tick <= c.state_tick);
}

Outcome begin_tick(const TickContext& terms, Character& c) {
  HAIRNET_ASSERT(!c.suspended);
  // A character has at most one turn in a tick.
  HAIRNET_ASSERT(c.state_tick <= terms.tick);
  if (!is_due(terms, c)) return Outcome::waiting;
  HAIRNET_ASSERT(terms.tick + 1 - c.state_tick <= kStrideMax);
  c.steps_next_tick = false;
  c.step_ticks = static_cast<std::uint8_t>(terms.tick + 1 - c.state_tick);
  c.state_tick = terms.tick + 1;
  const StepPlan& plan = terms.plan(c);
  const Vec3 velocity_before = c.head_velocity;
  const bool is_marked = std::exchange(c.teleport, false);
  // A marked jump says nothing about how the head moves on.
  if (!is_marked) c.head_velocity = velocity_to_expect(c.from, c.to, plan.interval_s, velocity_before);
  c.discontinuous = is_marked || is_teleport(c.from, c.to, plan.interval_s, velocity_before);
  const bool bones_move = c.discontinuous || !is_still(c.still_pose, c.to);
  c.bones_still_s = bones_move ? 0 : c.bones_still_s + (c.is_asleep() ? 0 : plan.interval_s);
  // The still pose stays where the bones last moved, so a slow drift adds up until it counts as a move.
  if (bones_move || !terms.environment(c).wind.is_still()) {
    c.wake();
    c.still_pose = c.to;
  }
  if (c.is_asleep()) return Outcome::asleep;
  c.changed_tick = c.state_tick;
  c.last_step_s = plan.substep_s();
  Outcome outcome = Outcome::idle;
  if (c.rigid_ease_s >= 0) {
    ease_to_rigid(plan.interval_s, c);
    outcome = Outcome::eased;
  } else if (c.discontinuous) {
    outcome = Outcome::teleport;
    // A hand does not jump with the head: its hold would pull the hair across the room. Pins go along.
    end_hands(c);
    make_velocity_relative(c);
  } else if (c.model()) {
    // After a jump hair starts as if the head had always moved as it does in this turn, so it gets no kick.
    if (std::exchange(c.velocity_is_relative, false)) add_next_rigid_velocity(plan, c);
    ease_in(terms, c);
    // Settling needs the state before the turn, to go back half of the way.
    if (still_s(terms, c) >= settle_after_s(c)) c.unsettled = c.state;
    check_invariants(c);
    return Outcome::stepped;
  } else if (c.network()) {
    return Outcome::stepped;
  }
  // The pose before a jump says nothing about the motion after it.
  if (c.network()) c.learnt.state.poses.forget();
  end_turn(terms, c);
  if (outcome == Outcome::idle) c.still_s += plan.interval_s;
  check_invariants(c);
  return outcome;
}

void put_inputs(const TickContext& terms, const Character& c, std::span<StepInput> inputs) {
  const StepPlan& plan = terms.plan(c);
  HAIRNET_ASSERT(inputs.size() == static_cast<std::size_t>(plan.substep_count));
  // The character's begin_tick() has run in this tick.
  HAIRNET_ASSERT(c.state_tick == terms.tick + 1);
  const std::uint64_t first_tick = terms.tick + 1 - c.step_ticks;
  for (std::size_t s = 0; s < inputs.size(); ++s) {
    StepInput& input = inputs[s];
    const double share = static_cast<double>(s + 1) / static_cast<double>(inputs.size());
    input.touch = nullptr;
    input.from = s == 0 ? c.from : inputs[s - 1].to;
    input.to = s + 1 == inputs.size() ? c.to : interpolate(c.from, c.to, share);
    input.step_s = plan.substep_s();
    input.environment = &terms.environment(c);
    input.contact_release = c.contact_release;
    input.material = c.material;
    input.material.stiffness *= static_cast<float>(c.stiffness);
    // Time counts from the world's tick 0 and not from the turn, so the wind does not depend on strides.
    input.time_s = (static_cast<double>(first_tick) + share * c.step_ticks) * terms.tick_s;
  }
}

Outcome end_tick(const TickContext& terms, std::span<const StepInput> inputs, bool is_finite, Character& c) {
  HAIRNET_ASSERT(!inputs.empty());
  HAIRNET_ASSERT(c.model());
  c.last_from = inputs.back().from;
  c.from = c.to;
  if (!is_finite) {
    // No history of the lattice is left, and frames must not be interpolated across the reset.
    reset_to_rest(*c.model(), c.state);
    end_holds(c);
    c.discontinuous = true;
    check_invariants(c);
    return Outcome::reset;
  }
  // settle replaces the speed that count_stillness reads. slip_holds comes between: anchors slide after hair that has
  // settled.
  settle(terms, c);
  if (c.touch) slip_holds(c);
  count_stillness(terms.plan(c).interval_s, c);
  check_invariants(c);
  return Outcome::stepped;
}

void step_learnt_turns(const TickContext& terms, std::span<Character* const> characters) {
  HAIRNET_ASSERT(!characters.empty() && characters.size() <= kLearntWidth);
  std::array<LearntMotion, kLearntWidth> motions;
  // The air at the head: one entry for each tick of the longest stride, and one for the pose from which the turn
  // starts.
  std::array<std::array<Vec3, kStrideMax + 1>, kLearntWidth> air_world;
  const LearntHair& hair = *characters[0]->network();
  // The network knows only ticks of kLearntTick_s; World::set_level refuses it at another tick rate.
  const double interval_s = terms.plan(*characters[0]).interval_s;
  const int ticks = std::max(1, static_cast<int>(std::lround(interval_s / kLearntTick_s)));
  HAIRNET_ASSERT(ticks <= kStrideMax);
  for (std::size_t i = 0; i < characters.size(); ++i) {
    Character& c = *characters[i];
    HAIRNET_ASSERT(c.network() == &hair);
    HAIRNET_ASSERT(c.step_ticks == characters[0]->step_ticks);
    const bool begins = !std::exchange(c.learnt.has_begun, true);
    motions[i] = {&c.learnt.state, &c.from, &c.to, ticks, begins, c.learnt.coefficients};
    const WindField& wind = terms.environment(c).wind;
    motions[i].air_is_carried = wind.is_carried();
    if (wind.is_still()) continue;
    const std::span<Vec3> air = std::span(air_world[i]).first(static_cast<std::size_t>(ticks) + 1);
    // The air at the start matters only to a network that begins. Any other network has seen that air at the end of its
    // last turn.
    for (int tick = begins ? 0 : 1; tick <= ticks; ++tick) {
      const double share = static_cast<double>(tick) / ticks;
      const Vec3 place = wind.is_carried() ? Vec3::Zero() : interpolate(c.from, c.to, share).head().position;
      const double time_s = (static_cast<double>(terms.tick + 1) - (1 - share) * c.step_ticks) * terms.tick_s;
      air[static_cast<std::size_t>(tick)] = wind.velocity(place, time_s);
    }
    motions[i].air_world = air;
  }
  step_learnt(hair, std::span(motions).first(characters.size()));
  for (std::size_t i = 0; i < characters.size(); ++i) characters[i]->learnt.is_covered = motions[i].is_covered;
  for (Character* c : characters) {
    end_turn(terms, *c);
    // A network has no nodes whose speed could be measured, so its hair counts as still with its bones. It forgets
    // within two seconds, and sleep begins after kSleepAfter_s.
    if (c->bones_still_s > 0) c->still_s += interval_s;
    check_invariants(*c);
  }
}

void suspend(Character& c) {
  HAIRNET_ASSERT(!c.suspended);
  c.suspended = true;
  c.touch.reset();
  make_velocity_relative(c);
}

void unsuspend(std::uint64_t tick, Character& c) {
  HAIRNET_ASSERT(c.suspended);
  HAIRNET_ASSERT(c.state_tick <= tick);
  c.suspended = false;
  // The turn covers one tick, whatever time has passed: the motion in between is unknown, so it is a teleport.
  c.steps_next_tick = c.teleport = true;
  c.state_tick = tick;
  c.wake();
}

bool replace_state(std::span<const Vec3f> displacement, std::span<const Vec3f> velocity, Character& c) {
  const Level* level = c.model();
  if (!level || c.rigid_ease_s >= 0) return false;
  const std::size_t count = level->rest.size();
  if (displacement.size() != count || (!velocity.empty() && velocity.size() != count)) return false;
  const float farthest_m = level->displacement_max_m + kStateSlack_m;
  // The comparison is written so that NaN fails.
  const auto within = [](float most) { return [most](const Vec3f& x) { return x.squaredNorm() <= most * most; }; };
  if (!std::ranges::all_of(displacement, within(farthest_m))) return false;
  if (!std::ranges::all_of(velocity, within(kStateSpeedMax_m_per_s))) return false;
  end_holds(c);
  reset_to_rest(*level, c.state);
  HAIRNET_ASSERT(c.state.displacement.size() == displacement.size());
  std::ranges::copy(displacement, c.state.displacement.begin());
  // Velocities of a ride would blow the hair off a head that stands.
  const bool is_usable = !velocity.empty() && std::ranges::all_of(velocity, within(kStateRideSpeed_m_per_s));
  if (is_usable) std::ranges::copy(velocity, c.state.velocity.begin());
  c.last_from = is_usable ? c.last_from : c.from;
  c.velocity_is_relative = !is_usable;
  c.wake();
  return true;
}

}  // namespace hairnet
