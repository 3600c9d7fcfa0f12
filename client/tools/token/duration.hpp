#pragma once

#include <cstdint>
#include <optional>
#include <string_view>

namespace hairnet::token {

// Parses "90s", "15m", "12h", "30d" to seconds, up to ten years; none for anything else, also for zero and negative
// times. Plain digits are seconds.
std::optional<std::int64_t> parse_duration_s(std::string_view text);

}  // namespace hairnet::token
