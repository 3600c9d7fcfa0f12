#include "core/world/room_bodies.hpp"

#include <algorithm>
#include <functional>

#include "core/assert.hpp"
#include "core/world/stillness.hpp"

namespace hairnet {
namespace {

TouchKey key_of(const RoomBody& body) {
  return body.body.key;
}

// The speed of the body's fastest point.
double speed_m_per_s(const RoomBody& b, double tick_s) {
  const double shift_m = (b.body.place.position - b.from.position).norm();
  const double turn_rad = b.from.rotation.angularDistance(b.body.place.rotation);
  return (shift_m + turn_rad * b.bounding_radius_m) / tick_s;
}

// Takes over from the tick before what a body of the same key had: where it was, and whether it is still.
void continue_from(const RoomBody& before, double tick_s, RoomBody& body) {
  // A body that is set twice in a tick still moves from where it was at the tick's start, and stays marked as moving:
  // rest_bodies alone ends its way.
  body.from = before.from;
  body.still_place = before.still_place;
  body.moves = before.moves || body.body.shape != before.body.shape || !is_still(body.still_place, body.body.place);
  // A jump over a crowd must not sweep all hair on the way along.
  if (body.body.has_jumped || speed_m_per_s(body, tick_s) > kTouchSpeedMax_m_per_s) body.from = body.body.place;
  if (body.moves) body.still_place = body.body.place;
}

}  // namespace

const RoomBody* find_body(const RoomBodies& room, const TouchKey& key) {
  const auto found = std::ranges::lower_bound(room, key, {}, key_of);
  return found != room.end() && key_of(*found) == key ? &*found : nullptr;
}

RoomBodies move_bodies(const RoomBodies& before, std::span<const TouchBody> bodies, double tick_s) {
  HAIRNET_ASSERT(std::ranges::adjacent_find(bodies, std::ranges::greater_equal{}, &TouchBody::key) == bodies.end());
  RoomBodies room;
  room.reserve(bodies.size());
  for (const TouchBody& body : bodies) {
    HAIRNET_ASSERT(validate(body).empty());
    RoomBody& b = room.emplace_back(RoomBody{body, body.place, body.place, bounding_radius(body.shape)});
    if (const RoomBody* old = find_body(before, body.key)) continue_from(*old, tick_s, b);
  }
  return room;
}

void rest_bodies(RoomBodies& room) {
  for (RoomBody& body : room) {
    body.from = body.body.place;
    body.moves = false;
  }
}

}  // namespace hairnet
