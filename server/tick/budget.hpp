#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "core/levels/level.hpp"
#include "server/tick/budget_fill.hpp"
#include "server/tick/cost_estimate.hpp"

namespace hairnet::server {

// A character's level of detail: the level of its lattice, and how often it is stepped and sent.
struct Lod {
  LevelIndex level = LevelIndex::rigid;
  std::uint8_t stride = 1;
  bool suspended = false;
  friend bool operator==(const Lod&, const Lod&) = default;
};

// One character as input to choose_levels().
struct BudgetCharacter {
  // The CharacterKey: unique, so it breaks ties between characters that are equal otherwise.
  std::uint64_t key = 0;
  // The character belongs to this session, and the session to this subject, whose characters share one part of the
  // budget.
  std::uint64_t session = 0;
  std::uint32_t subject = 0;
  // The number of observers that get the character's frames.
  std::uint32_t observer_count = 0;
  // The height of the head over the height of the screen, the largest over its observers. Clients report it.
  float importance = 0;
  // No observer has had the character in view for this long; zero: one has it in view now.
  float unseen_s = 0;
  // The speeds of the head, smoothed over about a second.
  float head_speed_m_per_s = 0, head_angular_speed_rad_per_s = 0;
  // The finest level that its owner asked for.
  LevelIndex requested_level = LevelIndex::high;
  // The levels of its groom are built. Without them the character is rigid.
  bool levels_ready = false;
  // The learnt level may be used: the groom has learnt hair, which fits the material, the motion and the wind.
  bool may_learn = false;
  // The hair is at rest, so that a step costs nothing; a hand or prop is near the hair or holds it. Both are as in
  // LatticeView.
  bool asleep = false;
  bool is_touched = false;
  // The present Lod.
  Lod now;
  // The present Lod was chosen this long ago; infinite for a new character, zero for one that should not change.
  double since_s = std::numeric_limits<double>::infinity();
};

// What a tick has and what frames cost, measured. All times are worker-seconds: seconds of one worker, summed over
// workers.
struct BudgetTerms {
  // A tick has this many worker-seconds for its work on characters (TickGuard::available_s).
  double available_s = 0;
  // The cost of steps; must be set.
  const CostEstimate* cost = nullptr;
  // One frame of a level takes this many worker-seconds to encode, for any number of observers.
  std::array<double, kLevelCount> encode_s{};
  // One frame to one observer takes this long to send.
  double send_s = 0;
};

// What choose_levels() has decided, for gauges and for TickGuard.
struct BudgetReport {
  // A tick takes this time with the chosen levels.
  double predicted_s = 0;
  // A tick would take this time with every character at its requested level.
  double wanted_s = 0;
  // The numbers of characters that get a finer or a coarser rung.
  std::uint32_t raised = 0, lowered = 0;
  // The number of characters that may be seen and have not the finest rung that they may have.
  std::uint32_t below_wanted = 0;
  // Not even rung 0 of all characters fits.
  bool is_over = false;
};

// Raising may fill this share of the available time. The distance to kBudgetDown keeps noise of the measured costs from
// raising and lowering the same characters in turn.
inline constexpr double kBudgetUp = 0.9;
// When the budget is exceeded, lowering goes down to this share.
inline constexpr double kBudgetDown = 0.95;
// A character keeps a new level at least this long before it is raised again, or lowered in favour of another one. An
// exceeded budget does not wait.
inline constexpr double kLodDwell_s = 0.5;
// A character that nobody has seen for this long is not stepped. A shorter time would suspend hair at each short look
// away.
inline constexpr float kSuspendAfter_s = 1;

// Buffers that are reused from call to call.
struct BudgetScratch {
  std::vector<std::uint32_t> order;
  std::vector<BudgetItem> items;
  std::vector<std::uint8_t> target, entitled;
  std::vector<std::uint32_t> raises;
  FillScratch fill;
};

// Chooses the Lod of every character; README.md, "Budget", has the rule. Pure: the result depends on the arguments
// only, and not on the order of `characters`. Writes `chosen[i]` for `characters[i]`; asserts that both have the same
// size. Keys must be unique.
BudgetReport choose_levels(const BudgetTerms& terms, std::span<const BudgetCharacter> characters,
                           BudgetScratch& scratch, std::span<Lod> chosen);

// Error of hair on a level and stride against the full model, relative to its motion. Rigid hair has an error of 1, and
// more when its head moves at fewer ticks.
double expected_error(LevelIndex level, int stride);

}  // namespace hairnet::server
