#pragma once

#include <span>
#include <vector>

#include "core/touch/touch_body.hpp"

namespace hairnet {

// A body of a room over the coming tick.
struct RoomBody {
  TouchBody body;
  // Is where it is at the tick's start: its place, unless it moves there.
  RigidTransform from;
  // The body has stayed near this place since it last moved.
  RigidTransform still_place;
  double bounding_radius_m = 0;
  // Hair near it must not sleep: it moves, or is not as it was.
  bool moves = true;
};

// Ascends by key.
using RoomBodies = std::vector<RoomBody>;

// Returns null when the room has no such body.
const RoomBody* find_body(const RoomBodies& room, const TouchKey& key);

// The bodies of a room, each moving in a tick from where the one with its key is in `before`. One that is new, has
// jumped or would move faster than kTouchSpeedMax_m_per_s at some point of it does not sweep: it begins at its place.
// Asserts that the bodies are valid and their keys ascend.
RoomBodies move_bodies(const RoomBodies& before, std::span<const TouchBody> bodies, double tick_s);

// Ends the tick: all bodies stay where they are.
void rest_bodies(RoomBodies& room);

}  // namespace hairnet
