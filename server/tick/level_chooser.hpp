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
  // The share of a tick that its work may take.
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

  // Appends the changes to `inputs`. `simulation` is in the state of the last tick.
  void choose(Rooms& rooms, const Simulation& simulation, wire::RecordedTick& inputs);

  // Takes the costs of the steps and the duration of a tick. Publishing has stored its times in rooms, observers and
  // characters.
  void observe(Rooms& rooms, const StepCosts& costs, double tick_duration_s);

 private:
  // True when the level of a character must not wait for the next choice.
  bool note_unseen(Rooms& rooms, const Simulation& simulation) const;
  [[nodiscard]] BudgetCharacter as_budgeted(const Character& character, bool ready, std::uint64_t tick) const;
  // Whether the learnt level holds for the character in this room.
  [[nodiscard]] bool may_learn(const Room& room, const Simulation& simulation, Character& character,
                               std::uint64_t tick) const;
  // Writes what differs from the present Lod into the inputs, so that a recording has it.
  void apply(Character& character, const Lod& lod, wire::RecordedTick& inputs);

  LevelChooserDef def_;
  TickCounters* counters_;
  CostEstimate cost_;
  TickGuard guard_;
  // A frame takes this long to encode, smoothed.
  std::array<double, kLevelCount> encode_s_{};
  double send_s_ = 0;
  // Is the last prediction.
  double wanted_s_ = 0;
  // The last tick exceeded its budget.
  bool over_ = false;
  std::vector<Character*> placed_;
  std::vector<BudgetCharacter> budgeted_;
  std::vector<Lod> chosen_;
  BudgetScratch scratch_;
};

}  // namespace hairnet::server
