#pragma once

#include <cstdint>
#include <map>

#include "schema/wire/messages.hpp"

namespace hairnet::server {

// A room's props, by their numbers.
using Props = std::map<std::uint8_t, wire::Prop>;

// A prop that a change both removes and sets is there afterwards.
inline void apply(const wire::SetProps& change, Props& props) {
  for (const std::uint8_t number : change.removed) props.erase(number);
  for (const wire::Prop& prop : change.props) props.insert_or_assign(prop.number, prop);
}

}  // namespace hairnet::server
