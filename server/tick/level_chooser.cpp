#include "server/tick/level_chooser.hpp"

#include <algorithm>

#include "core/assert.hpp"
#include "core/learnt/learnt_hair.hpp"

namespace hairnet::server {
namespace {

// Levels are chosen once in this many ticks, unless a change is urgent (note_unseen) or the last tick took too long.
constexpr std::uint64_t kTicksBetween = 4;
// The weight of one tick in the means of measured times. A mean follows a change by two thirds in about 20 ticks, 0.7 s
// at 30 Hz; a single slow tick hardly moves it.
constexpr double kSmoothing = 0.05;
// The available time where there is no clock: so much that every character gets the finest level that its owner asked
// for. Tests then get the same levels on every machine.
constexpr double kUnbounded_s = 1e9;
// After a motion on which the network was not trained, a character stays off the learnt level for this long.
constexpr double kUncovered_s = 2;

// Moves the mean towards the value of one tick. A mean of zero has no value yet.
void smooth(double& mean, double value) {
  HAIRNET_ASSERT(value >= 0);
  // The first value is taken as it is.
  mean += (mean == 0 ? 1 : kSmoothing) * (value - mean);
}

// The level, stride and suspension that the character has now.
Lod lod_of(const Character& character) {
  HAIRNET_ASSERT(wire::is_stride(static_cast<std::uint64_t>(character.stride)));
  return {character.level, static_cast<std::uint8_t>(character.stride), character.suspended};
}

}  // namespace

LevelChooser::LevelChooser(const LevelChooserDef& def, TickCounters& counters)
    : def_(def),
      counters_(&counters),
      cost_(def.tick_s),
      guard_({.tick_s = def.tick_s, .tick_share = def.tick_share, .workers = def.workers}) {}

bool LevelChooser::note_unseen(Rooms& rooms, const Simulation& simulation) const {
  bool is_urgent = false;
  for (Character* one : rooms.everyone()) {
    Character& character = *one;
    if (!character.in_world) continue;
    character.unseen_ticks = character.seen ? 0 : character.unseen_ticks + 1;
    // Four cases do not wait for the next choice: somebody looks at suspended hair; a hand touches learnt hair, which
    // knows no hands; an owner asks for a coarser level than the present one; levels have become ready.
    is_urgent = is_urgent || (character.suspended && character.seen) ||
                (character.lattice.is_touched && character.level == LevelIndex::learnt) ||
                (character.requested_level > character.level && character.requested_level != LevelIndex::learnt) ||
                (character.level == LevelIndex::rigid && character.requested_level != LevelIndex::rigid &&
                 !character.lod_chosen && simulation.has_levels(character.groom));
  }
  return is_urgent;
}

BudgetCharacter LevelChooser::as_budgeted(const Character& character, bool ready, std::uint64_t tick) const {
  BudgetCharacter b;
  b.key = character.key;
  b.session = session_of(character.key);
  b.subject = character.subject;
  b.observer_count = character.observer_count;
  b.importance = character.screen_height;
  b.unseen_s = static_cast<float>(static_cast<double>(character.unseen_ticks) * def_.tick_s);
  b.head_speed_m_per_s = character.head_speed_m_per_s;
  b.head_angular_speed_rad_per_s = character.head_angular_speed_rad_per_s;
  b.requested_level = character.requested_level;
  b.levels_ready = ready;
  b.asleep = character.asleep;
  b.is_touched = character.lattice.is_touched;
  b.now = lod_of(character);
  HAIRNET_ASSERT(!character.lod_chosen || character.lod_since <= tick);
  HAIRNET_ASSERT(b.importance >= 0);
  if (character.lod_chosen) b.since_s = static_cast<double>(tick - character.lod_since) * def_.tick_s;
  // A hand held the hair after the last tick. Another level would end the hold, so the character counts as changed just
  // now.
  if (character.held_tick == tick - 1) b.since_s = 0;
  return b;
}

bool LevelChooser::may_learn(const Room& room, const Simulation& simulation, Character& character,
                             std::uint64_t tick) const {
  const LearntHair* const learnt = simulation.learnt(character.groom);
  if (!is_learnt_tick(def_.tick_s) || !learnt) return false;
  // The network has met a motion beyond its training; it pauses, so that the level does not change with each of them.
  if (character.lattice.level == LevelIndex::learnt && !character.lattice.is_covered)
    character.learnt_next = tick + static_cast<std::uint64_t>(kUncovered_s / def_.tick_s);
  // The network is trained without hands, in air up to some speed, and with the built-in material.
  return tick >= character.learnt_next && !character.lattice.is_touched &&
         learnt->covers_air(gust_m_per_s(room.wind)) && character.material == MaterialScale{};
}

void LevelChooser::choose(Rooms& rooms, const Simulation& simulation, wire::RecordedTick& inputs) {
  const bool is_urgent = note_unseen(rooms, simulation);
  // While ticks take too long, every tick chooses again.
  if (!is_urgent && !over_ && inputs.tick % kTicksBetween != 0) return;
  placed_.clear();
  budgeted_.clear();
  for (Character* character : rooms.everyone()) {
    if (!character->in_world) continue;
    placed_.push_back(character);
    budgeted_.push_back(as_budgeted(*character, simulation.has_levels(character->groom), inputs.tick));
    budgeted_.back().may_learn = may_learn(rooms.room(character->room), simulation, *character, inputs.tick);
  }
  chosen_.resize(budgeted_.size());
  BudgetTerms terms;
  terms.available_s = def_.now_ns ? guard_.available_s() : kUnbounded_s;
  terms.cost = &cost_;
  terms.encode_s = encode_s_;
  terms.send_s = send_s_;
  const BudgetReport report = choose_levels(terms, budgeted_, scratch_, chosen_);
  wanted_s_ = report.wanted_s;
  counters_->levels_raised.add(report.raised);
  counters_->levels_lowered.add(report.lowered);
  counters_->gauges.budget_predicted_seconds.set(report.predicted_s);
  counters_->gauges.budget_wanted_seconds.set(report.wanted_s);
  counters_->gauges.budget_available_seconds.set(terms.available_s);
  counters_->gauges.budget_over.set(report.is_over ? 1 : 0);
  counters_->gauges.characters_below_wanted.set(report.below_wanted);
  for (std::size_t i = 0; i < placed_.size(); ++i) {
    if (budgeted_[i].levels_ready || chosen_[i].level == LevelIndex::rigid) apply(*placed_[i], chosen_[i], inputs);
  }
}

void LevelChooser::apply(Character& character, const Lod& lod, wire::RecordedTick& inputs) {
  const LevelIndex level = lod.level;
  HAIRNET_ASSERT(character.in_world);
  HAIRNET_ASSERT(wire::is_stride(lod.stride));
  const bool ready = level != LevelIndex::rigid;
  if (!(lod == lod_of(character)) || !character.lod_chosen) character.lod_since = inputs.tick;
  character.lod_chosen = character.lod_chosen || ready;
  if (level != character.level) {
    character.level = level;
    inputs.levels.push_back({character.key, level});
    counters_->levels_entered.add();
  }
  if (lod.stride != character.stride) {
    character.stride = lod.stride;
    inputs.strides.push_back({character.key, lod.stride});
  }
  if (lod.suspended != character.suspended) {
    character.suspended = lod.suspended;
    inputs.suspensions.push_back({character.key, lod.suspended});
  }
}

void LevelChooser::observe(Rooms& rooms, const StepCosts& costs, double tick_duration_s) {
  if (!def_.now_ns) return;
  cost_.observe(costs);
  over_ = tick_duration_s > def_.tick_share * def_.tick_s;
  std::array<std::int64_t, kLevelCount> encode_ns{};
  std::array<std::size_t, kLevelCount> encoded{};
  for (const Character* character : rooms.everyone()) {
    if (character->variant_count == 0) continue;
    HAIRNET_ASSERT(character->variant_count <= character->variants.size());
    encode_ns[static_cast<std::size_t>(character->shown)] += character->encode_ns;
    ++encoded[static_cast<std::size_t>(character->shown)];
  }
  std::int64_t send_ns = 0;
  std::size_t sent = 0;
  for (const auto& [session, observer] : rooms.observers()) {
    send_ns += observer.send_ns;
    sent += observer.requests.size();
  }
  std::int64_t step_ns = 0, all_encode_ns = 0;
  for (std::size_t l = 0; l < kLevelCount; ++l) {
    if (encoded[l] > 0)
      smooth(encode_s_[l], static_cast<double>(encode_ns[l]) * 1e-9 / static_cast<double>(encoded[l]));
    all_encode_ns += encode_ns[l];
    for (const StepCost& cost : costs.sums[l]) step_ns += cost.step_ns;
    counters_->gauges.step_cost_seconds[static_cast<LevelIndex>(l)].set(cost_.turn_s(static_cast<LevelIndex>(l), 1));
  }
  // A mean over all observers: sending differs little from one to the next, and a mean of each would be noise.
  if (sent > 0) smooth(send_s_, static_cast<double>(send_ns) * 1e-9 / static_cast<double>(sent));
  // The work on characters is the sum of steps, encoding and sending. TickGuard takes the rest of the tick as overhead.
  guard_.observe(tick_duration_s, static_cast<double>(step_ns + all_encode_ns + send_ns) * 1e-9, wanted_s_);
  counters_->step_ns_total.add(static_cast<std::uint64_t>(step_ns));
  counters_->encode_ns_total.add(static_cast<std::uint64_t>(all_encode_ns));
  counters_->send_ns_total.add(static_cast<std::uint64_t>(send_ns));
}

}  // namespace hairnet::server
