#include "client/tools/token/duration.hpp"

#include <charconv>

namespace hairnet::token {
namespace {

constexpr std::int64_t kDay_s = 86'400;
// The longest duration is ten years, with their leap days.
constexpr std::int64_t kMax_s = 3653 * kDay_s;

// Returns the seconds of a unit, 0 for an unknown one.
std::int64_t unit_s(std::string_view unit) {
  if (unit.empty() || unit == "s") return 1;
  if (unit == "m") return 60;
  if (unit == "h") return 3600;
  return unit == "d" ? kDay_s : 0;
}

}  // namespace

std::optional<std::int64_t> parse_duration_s(std::string_view text) {
  std::int64_t count = 0;
  const char* const last = text.data() + text.size();
  // Whatever follows the digits must be a unit.
  const auto [end, error] = std::from_chars(text.data(), last, count);
  if (error != std::errc()) return std::nullopt;
  const std::int64_t unit = unit_s({end, static_cast<std::size_t>(last - end)});
  // Dividing the limit instead of multiplying the count cannot overflow.
  if (unit == 0 || count < 1 || count > kMax_s / unit) return std::nullopt;
  return count * unit;
}

}  // namespace hairnet::token
