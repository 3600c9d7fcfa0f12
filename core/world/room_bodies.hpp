#pragma once

#include <span>
#include <vector>

#include "core/touch/touch_body.hpp"

namespace hairnet {

// A body of a room over the coming tick.
struct RoomBody {
  TouchBody body;
  // The body's place at the tick's start. A body that does not move over the tick has body.place here.
  RigidTransform from;
  // The body has stayed near this place since it last moved.
  RigidTransform still_place;
  // The radius of a ball about body.place that contains the shape.
  double bounding_radius_m = 0;
  // Hair near the body must not fall asleep: the body moves in this tick, is new, or has changed.
  bool moves = true;
};

// The bodies of one room, ascending by key.
using RoomBodies = std::vector<RoomBody>;

// Returns null when the room has no such body.
const RoomBody* find_body(const RoomBodies& room, const TouchKey& key);

// The bodies of a room in the coming tick. Each moves from where `before` has the body of the same key. A body begins
// at its place, and so does not sweep hair along, when it is new, has jumped, or its fastest point would exceed
// kTouchSpeedMax_m_per_s. Asserts that the bodies are valid and their keys ascend.
RoomBodies move_bodies(const RoomBodies& before, std::span<const TouchBody> bodies, double tick_s);

// Ends the tick: all bodies stay where they are.
void rest_bodies(RoomBodies& room);

}  // namespace hairnet
