#pragma once

#include <cstdint>
#include <vector>

#include "core/world/simulation.hpp"
#include "core/world/world.hpp"
#include "schema/wire/recording.hpp"
#include "server/room/room.hpp"
#include "server/tick/budget.hpp"
#include "server/tick/budget_guard.hpp"
#include "server/tick/tick_counters.hpp"

namespace hairnet::server {

struct LevelChooserDef {
  double tick_s = 1.0 / 30;
  // The share of a tick that its work may take (`--tick-budget`).
  double tick_share = 0.7;
  int workers = 1;
  // Null: nothing is measured, and every character gets the level that its owner asked for.
  ClockNs now_ns = nullptr;
};

// Chooses every character's level and stride, and whether it is suspended, from measured times. Collects the inputs of
// choose_levels() (budget.hpp) and applies its result. Tick thread.
class LevelChooser {
 public:
  LevelChooser(const LevelChooserDef& def, TickCounters& counters);

  // Sets the levels, strides and suspensions of the characters in `rooms`, and appends the changes to `inputs`. Chooses
  // at every fourth tick, and sooner where a change is urgent. `simulation` is in the state of the last tick.
  void choose(Rooms& rooms, const Simulation& simulation, wire::RecordedTick& inputs);

  // Takes the costs of the steps and the duration of a tick. Publishing has stored its times in rooms, observers and
  // characters.
  void observe(Rooms& rooms, const StepCosts& costs, double tick_duration_s);

 private:
  // Updates for how many ticks no observer has seen each character. Returns true when the level of a character must not
  // wait for the next regular choice.
  bool note_unseen(Rooms& rooms, const Simulation& simulation) const;
  // Makes the input of choose_levels() for one character. `ready`: its groom has levels.
  [[nodiscard]] BudgetCharacter as_budgeted(const Character& character, bool ready, std::uint64_t tick) const;
  // Whether the character may be on the learnt level now: README.md, "Budget", the ladder.
  [[nodiscard]] bool may_learn(const Room& room, const Simulation& simulation, Character& character,
                               std::uint64_t tick) const;
  // Gives the character this Lod, and writes the differences from the present one into the inputs, which the World gets
  // and a recording has.
  void apply(Character& character, const Lod& lod, wire::RecordedTick& inputs);

  LevelChooserDef def_;
  TickCounters* counters_;
  // cost_ estimates what a step of each level costs, and guard_ how much time of a tick is available for characters.
  CostEstimate cost_;
  TickGuard guard_;
  // Smoothed times in s: to encode one frame, by level; to send one frame to one observer.
  std::array<double, kLevelCount> encode_s_{};
  double send_s_ = 0;
  // BudgetReport::wanted_s of the last choice. TickGuard needs it at each tick.
  double wanted_s_ = 0;
  // The last tick took longer than its share (tick_share), so the next one chooses again.
  bool over_ = false;
  // The characters in the World; budgeted_ and chosen_ have the input and the result of each at the same index. All are
  // reused from tick to tick.
  std::vector<Character*> placed_;
  std::vector<BudgetCharacter> budgeted_;
  std::vector<Lod> chosen_;
  BudgetScratch scratch_;
};

}  // namespace hairnet::server
