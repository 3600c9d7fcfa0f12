#pragma once

#include <cstdint>
#include <set>
#include <vector>

#include "server/exchange/props.hpp"

namespace hairnet::server {

struct Observer;

// The props and hands of a room, which touch hair. Touch (server/tick/touch.hpp) changes them; Rooms only adds and
// removes the observers with hands. A room without any costs a tick one comparison. Tick thread.
struct RoomTouch {
  // The props in the room, by their numbers.
  Props props;
  // The numbers of the props that have changed or gone since the last tick. Neither the observers nor the World know of
  // these changes yet; the next tick passes them on.
  std::set<std::uint8_t> props_changed;
  // True once the room has had a prop. A client that resumes may then know props that are gone, so it is told the whole
  // list.
  bool had_props = false;
  // The observers whose hands the tick samples: their inboxes have a sample at the present time or a later one. Sorted
  // by session, so that every run gives the World the same order. Rooms owns the observers.
  std::vector<Observer*> touchers;
  // True when the bodies of this room differ from those in the World although no hand moves: a prop, a right or an
  // inbox has changed.
  bool is_changed = false;
  // True while the World has bodies under this room's index. After a room was closed they are those of the earlier
  // room, and must be replaced.
  bool is_in_world = false;
  // True while at least one observer was sent hands of other people, which it must be told to remove when they leave.
  bool are_hands_shown = false;
};

}  // namespace hairnet::server
