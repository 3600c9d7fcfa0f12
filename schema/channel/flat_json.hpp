#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

namespace hairnet::channel {

// The members of a JSON object that are strings, numbers, booleans or lists of strings. Other members are monostate.
using FlatJsonValue = std::variant<std::monostate, bool, std::int64_t, double, std::string, std::vector<std::string>>;
using FlatJson = std::map<std::string, FlatJsonValue>;

// Parses untrusted text. Returns nothing when it is not one JSON object in valid UTF-8, when a name appears twice, or
// when it is nested more than 8 deep. It builds no tree: objects within the object, and lists of anything but texts,
// are read past.
std::optional<FlatJson> parse_flat_json(std::string_view text);

}  // namespace hairnet::channel
