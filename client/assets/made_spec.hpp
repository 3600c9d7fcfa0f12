#pragma once

#include <string_view>

namespace hairnet {

// `made:NAME` asks for an asset that code makes; anything else is a path (`./made:x` for a file of such a name).
inline constexpr std::string_view kMadePrefix = "made:";
inline bool is_made_spec(std::string_view spec) {
  return spec.starts_with(kMadePrefix);
}
inline std::string_view made_name(std::string_view spec) {
  return spec.substr(kMadePrefix.size());
}

}  // namespace hairnet
