#pragma once

#include <cstdint>
#include <set>
#include <vector>

#include "server/exchange/props.hpp"

namespace hairnet::server {

struct Observer;

// What there is in a room that touches hair: props and hands. An empty one costs nothing.
struct RoomTouch {
  Props props;
  // The observers and the World do not know these yet.
  std::set<std::uint8_t> props_changed;
  // The room has had props: a client that comes back may know some that are gone.
  bool had_props = false;
  // Observers that have hands, or will have some; ascending by session.
  std::vector<Observer*> touchers;
  // The World has other bodies, also where no hand moves.
  bool is_changed = false;
  // The World has bodies of this room, or of an earlier one with its index.
  bool is_in_world = false;
  // Some observer knows hands of others.
  bool are_hands_shown = false;
};

}  // namespace hairnet::server
