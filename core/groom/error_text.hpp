#pragma once

#include <string>
#include <string_view>

namespace hairnet {

// Formats validation messages: "<what> <index>: <error>".
inline std::string error_at(std::string_view what, std::size_t index, std::string_view error) {
  return std::string(what) + ' ' + std::to_string(index) + ": " + std::string(error);
}

inline std::string over_limit(std::string_view what, std::size_t count, std::size_t most) {
  return std::to_string(count) + ' ' + std::string(what) + ", more than the limit of " + std::to_string(most);
}

// Describes a coordinate that is out of range, m from the head joint.
inline std::string too_far(float max_m) {
  return "not finite, or more than " + std::to_string(static_cast<int>(max_m)) + " m from the head";
}

}  // namespace hairnet
