#pragma once

#include <cstdint>
#include <optional>
#include <string_view>

namespace hairnet::token {

// "90s", "15m", "12h", "30d" in seconds, up to ten years; none when it is anything else. Plain digits are seconds.
std::optional<std::int64_t> parse_duration_s(std::string_view text);

}  // namespace hairnet::token
