#pragma once

#include <cstdint>
#include <set>
#include <vector>

#include "server/exchange/props.hpp"

namespace hairnet::server {

struct Observer;

// What there is in a room that touches hair. Nothing: nothing of it costs anything.
struct RoomTouch {
  Props props;
  // The observers and the World do not know these yet.
  std::set<std::uint8_t> props_changed;
  // The room has had props: who comes back may know some.
  bool had_props = false;
  // Have hands, or will have some; ascend by session.
  std::vector<Observer*> touchers;
  // The World has other bodies, also where no hand moves.
  bool is_changed = false;
  // The World has bodies of this room, or of an earlier one with its index.
  bool is_in_world = false;
  // Some observer knows hands of others.
  bool are_hands_shown = false;
};

}  // namespace hairnet::server
