#pragma once

#include <cstdint>
#include <set>
#include <vector>

#include "server/exchange/props.hpp"

namespace hairnet::server {

struct Observer;

// The props and hands of a room, which touch hair. Without any of them a tick does no work for the room.
struct RoomTouch {
  Props props;
  // The numbers of the props that have changed or gone, which the observers and the World do not know yet.
  std::set<std::uint8_t> props_changed;
  // The room has had props, so a client that resumes may know props that are gone, and is told all.
  bool had_props = false;
  // Observers that have hands, or will have some; ascending by session.
  std::vector<Observer*> touchers;
  // The bodies differ from those in the World, even if no hand moves.
  bool is_changed = false;
  // The World has bodies of this room, or of an earlier one with its index.
  bool is_in_world = false;
  // Some observer knows hands of others.
  bool are_hands_shown = false;
};

}  // namespace hairnet::server
