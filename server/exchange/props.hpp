#pragma once

#include <cstdint>
#include <map>

#include "schema/wire/messages.hpp"

namespace hairnet::server {

// A room's props (bodies that touch hair), by their numbers. The map's order makes every run treat them alike.
using Props = std::map<std::uint8_t, wire::Prop>;

// Applies a change to the props. A prop that a change both removes and sets is there afterwards. Sessions and ticks
// both call this, so that their copies of a room agree.
inline void apply(const wire::SetProps& change, Props& props) {
  for (const std::uint8_t number : change.removed) props.erase(number);
  for (const wire::Prop& prop : change.props) props.insert_or_assign(prop.number, prop);
}

}  // namespace hairnet::server
