#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/levels/level.hpp"
#include "core/result.hpp"

namespace hairnet::load {

enum class StageKind : std::uint8_t { ramp, steady, spike, soak };
inline constexpr std::array<std::string_view, 4> kStageKindNames{"ramp", "steady", "spike", "soak"};

// Clients that do not keep to the protocol, or to good manners.
enum class Misbehaviour : std::uint8_t { slow, flood, malformed, silent, half_open };
inline constexpr std::size_t kMisbehaviourCount = 5;
inline constexpr std::array<std::string_view, kMisbehaviourCount> kMisbehaviourNames{"slow", "flood", "malformed",
                                                                                     "silent", "half_open"};

// What attackers do to the server during a stage, beside all clients. attack_meanings() in attacks.cpp says how.
enum class Attack : std::uint8_t {
  zigzag,
  body,
  big,
  resume,
  offers,
  silent,
  hellos,
  prologue,
  churn,
  rooms,
  observe,
  wind,
  poses,
  appearances,
  rides,
  hands
};
inline constexpr std::array<std::string_view, 16> kAttackNames{
    "zigzag", "body",  "big",     "resume", "offers", "silent",      "hellos", "prologue",
    "churn",  "rooms", "observe", "wind",   "poses",  "appearances", "rides",  "hands"};

// A number of clients, given as such or as a share of the well-behaved clients.
struct Headcount {
  double value = 0;
  bool is_share = false;
  [[nodiscard]] std::uint32_t of(std::uint32_t clients) const;
};

inline constexpr std::uint32_t kClientCountMax = 20'000;
inline constexpr std::uint32_t kCharactersPerClientMax = 4096;
inline constexpr double kStageDurationMax_s = 7 * 24 * 3600.0;

// A part of the plan: its target population, and its events. Names are unique in a plan.
//   ramp    reaches the target evenly over its duration; not measured by default
//   steady  reaches it in the first second, and stays
//   spike   reaches it at once
//   soak    like steady, for a long time, to find what grows
struct Stage {
  StageKind kind = StageKind::steady;
  std::string name;
  double duration_s = 10;
  // The length of the warm-up at the stage's beginning, which is not measured.
  double warm_s = 0;
  bool measured = true;
  std::uint32_t clients = 1;
  // The number of characters of each client.
  std::uint32_t characters = 1;
  // The characters ask for these levels in turn.
  std::vector<LevelIndex> levels{LevelIndex::high};
  // So many clients a second leave, and each is replaced by a new one.
  double churn_hz = 0;
  // This share of the clients lose their connections in the middle of the stage, and connect again.
  double storm_share = 0;
  std::array<Headcount, kMisbehaviourCount> misbehaving{};
  std::optional<Attack> attack;
};

// Parses KIND:DURATION[:KEY=VALUE,...]. Missing keys are taken from the stage before, except churn, storm, attack,
// warm and measured. The error is one line.
Result<Stage> parse_stage(std::string_view text, const Stage* before);
// What parse_stage takes, with every key.
std::string to_text(const Stage& stage);

// 250ms, 30s, 5m, 1h.
Result<double> parse_duration_s(std::string_view text);

}  // namespace hairnet::load
