#include "tests/load/stage.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <optional>

namespace hairnet::load {
namespace {

// The whole text must be a finite number.
std::optional<double> number(std::string_view text) {
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size() || !std::isfinite(value)) return std::nullopt;
  return value;
}

std::vector<std::string_view> split(std::string_view text, char separator) {
  std::vector<std::string_view> parts;
  for (;;) {
    const std::size_t at = text.find(separator);
    parts.push_back(text.substr(0, at));
    if (at == std::string_view::npos) return parts;
    text.remove_prefix(at + 1);
  }
}

Result<double> number_within(std::string_view text, double least, double most) {
  const auto value = number(text);
  if (!value || *value < least || *value > most)
    return Refusal(fmt::format("'{}' is not a number in {} to {}", text, least, most));
  return *value;
}

Result<std::uint32_t> count_within(std::string_view text, std::uint32_t least, std::uint32_t most) {
  const auto value = number_within(text, least, most);
  if (!value) return Refusal(value.error());
  if (*value != std::floor(*value)) return Refusal(fmt::format("'{}' is not a whole number", text));
  return static_cast<std::uint32_t>(*value);
}

// 0.25 or 25%.
Result<double> share(std::string_view text) {
  if (!text.ends_with('%')) return number_within(text, 0, 1);
  const auto percent = number_within(text.substr(0, text.size() - 1), 0, 100);
  if (!percent) return Refusal(percent.error());
  return *percent / 100;
}

// A number of clients, or a share of the well-behaved ones such as 10%.
Result<Headcount> headcount(std::string_view text) {
  if (text.ends_with('%')) {
    const auto value = share(text);
    if (!value) return Refusal(value.error());
    return Headcount{*value, true};
  }
  const auto value = count_within(text, 0, kClientCountMax);
  if (!value) return Refusal(value.error());
  return Headcount{static_cast<double>(*value), false};
}

Result<std::vector<LevelIndex>> levels(std::string_view text) {
  std::vector<LevelIndex> found;
  for (const std::string_view name : split(text, '+')) {
    const auto known = std::ranges::find(kLevelNames, name);
    if (known == kLevelNames.end())
      return Refusal(fmt::format("'{}' is not one of high, medium, low, ether, learnt, rigid, joined by +", name));
    found.push_back(static_cast<LevelIndex>(known - kLevelNames.begin()));
  }
  return found;
}

template <class T, class U>
Result<void> assign(const Result<T>& value, U& to) {
  if (!value) return Refusal(value.error());
  to = *value;
  return {};
}

// Sets one KEY=VALUE of a stage (kFooter in options.cpp explains the keys).
Result<void> set(Stage& stage, std::string_view key, std::string_view value) {
  if (key == "clients") return assign(count_within(value, 0, kClientCountMax), stage.clients);
  if (key == "characters") return assign(count_within(value, 1, kCharactersPerClientMax), stage.characters);
  if (key == "level") return assign(levels(value), stage.levels);
  if (key == "churn") return assign(number_within(value, 0, 10'000), stage.churn_hz);
  if (key == "storm") return assign(share(value), stage.storm_share);
  if (key == "warm") return assign(parse_duration_s(value), stage.warm_s);
  if (key == "name") {
    const auto plain = [](char c) { return (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9') || c == '_' || c == '-'; };
    if (value.empty() || value.size() > 40 || !std::ranges::all_of(value, plain))
      return Refusal("a name has 1 to 40 of a-z, 0-9, _ and -");
    stage.name = value;
    return {};
  }
  if (key == "measured") {
    if (value != "yes" && value != "no") return Refusal(fmt::format("'{}' is not yes or no", value));
    stage.measured = value == "yes";
    return {};
  }
  if (key == "attack") {
    const auto known = std::ranges::find(kAttackNames, value);
    if (known == kAttackNames.end())
      return Refusal(fmt::format("'{}' is not one of {}", value, fmt::join(kAttackNames, ", ")));
    stage.attack = static_cast<Attack>(known - kAttackNames.begin());
    return {};
  }
  const auto kind = std::ranges::find(kMisbehaviourNames, key);
  if (kind != kMisbehaviourNames.end())
    return assign(headcount(value), stage.misbehaving[static_cast<std::size_t>(kind - kMisbehaviourNames.begin())]);
  return Refusal(
      "unknown key; there are name, clients, characters, level, churn, storm, attack, warm, measured, slow, flood, "
      "malformed, silent, half_open");
}

}  // namespace

std::uint32_t Headcount::of(std::uint32_t clients) const {
  return static_cast<std::uint32_t>(std::lround(is_share ? value * clients : value));
}

Result<double> parse_duration_s(std::string_view text) {
  struct Unit {
    std::string_view name;
    double seconds;
  };
  for (const Unit& unit : {Unit{"ms", 1e-3}, Unit{"s", 1}, Unit{"m", 60}, Unit{"h", 3600}}) {
    if (!text.ends_with(unit.name)) continue;
    const auto value = number(text.substr(0, text.size() - unit.name.size()));
    if (value && *value >= 0 && *value * unit.seconds <= kStageDurationMax_s) return *value * unit.seconds;
    break;
  }
  return Refusal(fmt::format("'{}' is not a duration such as 250ms, 30s, 5m or 1h (at most 7 days)", text));
}

Result<Stage> parse_stage(std::string_view text, const Stage* before) {
  const auto wrong = [&](const std::string& error) { return Refusal(fmt::format("stage '{}': {}", text, error)); };
  const std::vector<std::string_view> parts = split(text, ':');
  if (parts.size() < 2 || parts.size() > 3) return wrong("is not KIND:DURATION[:KEY=VALUE,...]");
  Stage stage;
  if (before) stage = *before;
  const auto kind = std::ranges::find(kStageKindNames, parts[0]);
  if (kind == kStageKindNames.end())
    return wrong(fmt::format("'{}' is not one of ramp, steady, spike, soak", parts[0]));
  stage.kind = static_cast<StageKind>(kind - kStageKindNames.begin());
  stage.name = parts[0];
  stage.measured = stage.kind != StageKind::ramp;
  // These describe one stage; all other keys go on from the stage before.
  stage.warm_s = stage.churn_hz = stage.storm_share = 0;
  stage.attack.reset();
  const auto duration = parse_duration_s(parts[1]);
  if (!duration) return wrong(duration.error());
  stage.duration_s = *duration;
  // The warm-up, the churn and the figures need a tenth of a second at least.
  if (stage.duration_s < 0.1) return wrong("lasts less than 100ms");
  if (parts.size() == 3 && !parts[2].empty()) {
    std::vector<std::string_view> seen;
    for (const std::string_view pair : split(parts[2], ',')) {
      const std::size_t equals = pair.find('=');
      if (equals == std::string_view::npos) return wrong(fmt::format("'{}' is not KEY=VALUE", pair));
      const std::string_view key = pair.substr(0, equals);
      if (std::ranges::count(seen, key) > 0) return wrong(fmt::format("{} is given twice", key));
      seen.push_back(key);
      if (const auto done = set(stage, key, pair.substr(equals + 1)); !done)
        return wrong(fmt::format("{}: {}", key, done.error()));
    }
  }
  if (stage.warm_s >= stage.duration_s) return wrong("is all warm-up");
  return stage;
}

// Writes every key, so that parse_stage() reads the same stage whatever stage comes before it.
std::string to_text(const Stage& stage) {
  std::string levels;
  for (const LevelIndex level : stage.levels)
    levels += (levels.empty() ? "" : "+") + std::string(kLevelNames[static_cast<std::size_t>(level)]);
  std::string text = fmt::format(
      "{}:{}ms:name={},clients={},characters={},level={},churn={},storm={},warm={}ms,measured={}",
      kStageKindNames[static_cast<std::size_t>(stage.kind)], stage.duration_s * 1e3, stage.name, stage.clients,
      stage.characters, levels, stage.churn_hz, stage.storm_share, stage.warm_s * 1e3, stage.measured ? "yes" : "no");
  for (std::size_t i = 0; i < kMisbehaviourCount; ++i) {
    const Headcount& count = stage.misbehaving[i];
    text += count.is_share ? fmt::format(",{}={}%", kMisbehaviourNames[i], count.value * 100)
                           : fmt::format(",{}={}", kMisbehaviourNames[i], count.value);
  }
  if (stage.attack) text += fmt::format(",attack={}", kAttackNames[static_cast<std::size_t>(*stage.attack)]);
  return text;
}

}  // namespace hairnet::load
