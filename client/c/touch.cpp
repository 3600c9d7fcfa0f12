// Hands and props in a room.
#include <algorithm>
#include <limits>

#include "client/c/handles.hpp"

namespace hairnet::c {
namespace {

// Enums of C and C++ are converted by their numbers; the last ones agree only if all do.
static_assert(HAIRNET_EVERYONE == static_cast<int>(TouchAudience::everyone));
static_assert(HAIRNET_UNPIN == static_cast<int>(Release::unpin));

constexpr std::uint32_t kNumberMax = std::numeric_limits<std::uint8_t>::max();

Vec3 point_of(const float* numbers) {
  return Eigen::Map<const Vec3f>(numbers).cast<double>();
}

Hand hand_of(const hairnet_hand& given) {
  Hand hand;
  // A number that is too large stays too large, and validate() refuses it; a plain conversion would wrap it to a valid
  // one.
  hand.first_number = static_cast<std::uint8_t>(std::min(given.first_number, kNumberMax));
  hand.place = place_of(given.rotation, given.position);
  hand.has_jumped = given.has_jumped != 0;
  for (std::size_t i = 0; i < given.shape_count; ++i) {
    const hairnet_hand_shape& shape = given.shapes[i];
    hand.shapes.push_back({point_of(shape.from), point_of(shape.to), double{shape.radius_m}, shape.is_inside_out != 0});
  }
  return hand;
}

hairnet_hand_shape shape_of(const HandShape& shape) {
  hairnet_hand_shape out{};
  Eigen::Map<Vec3f>(out.from) = shape.from.cast<float>();
  Eigen::Map<Vec3f>(out.to) = shape.to.cast<float>();
  out.radius_m = static_cast<float>(shape.radius_m);
  out.is_inside_out = shape.is_inside_out;
  return out;
}

hairnet_error no_such_member(char* error, std::size_t error_size) {
  return refuse(HAIRNET_NOT_THERE, "there is no such member", error, error_size);
}

}  // namespace
}  // namespace hairnet::c

using namespace hairnet;

hairnet_error hairnet_push_hands(hairnet_room* room, const hairnet_hand* hands, size_t count, char* error,
                                 size_t error_size) {
  return c::guarded(
      [&] {
        std::vector<Hand> pushed;
        for (std::size_t i = 0; i < count; ++i) pushed.push_back(c::hand_of(hands[i]));
        return c::done_or_error(room->room->push_hands(pushed), error, error_size);
      },
      error, error_size);
}

size_t hairnet_get_hands(const hairnet_room* room, hairnet_hand* hands, size_t capacity) {
  std::vector<hairnet_hand> all;
  room->hand_shapes.clear();
  for (const auto& [session, theirs] : room->room->hands()) {
    for (const Hand& hand : theirs) {
      hairnet_hand& out = all.emplace_back();
      out.session = session;
      c::write_place(hand.place, out.rotation, out.position);
      out.shape_count = hand.shapes.size();
      out.first_number = hand.first_number;
      out.has_jumped = hand.has_jumped;
      for (const HandShape& shape : hand.shapes) room->hand_shapes.push_back(c::shape_of(shape));
    }
  }
  // The shapes are pointed to only after all are there: the vector moves while it grows.
  const hairnet_hand_shape* shapes = room->hand_shapes.data();
  for (hairnet_hand& hand : all) {
    hand.shapes = shapes;
    shapes += hand.shape_count;
  }
  // The count of all is returned, so a caller sees that its array was too small.
  std::copy_n(all.begin(), std::min(capacity, all.size()), hands);
  return all.size();
}

hairnet_error hairnet_set_touch(hairnet_room* room, uint32_t own, hairnet_audience audience, const uint64_t* chosen,
                                size_t count, char* error, size_t error_size) {
  return c::guarded(
      [&] {
        if (static_cast<unsigned>(audience) > HAIRNET_EVERYONE)
          return c::refuse(HAIRNET_INVALID, "touch: there is no such audience", error, error_size);
        if (room->room->groom_of(own) == wire::GroomHash{}) return c::no_such_character(error, error_size);
        std::vector<std::uint64_t> sessions(chosen, chosen + count);
        return c::done_or_error(room->room->set_touch(own, static_cast<TouchAudience>(audience), std::move(sessions)),
                                error, error_size);
      },
      error, error_size);
}

int32_t hairnet_may_touch(const hairnet_room* room, uint32_t member) {
  const auto found = room->room->members().find(member);
  return found != room->room->members().end() && room->room->may_touch(*found->second);
}

hairnet_error hairnet_take_hold(hairnet_room* room, uint32_t member, uint32_t hand, const double place[3],
                                double radius_m, char* error, size_t error_size) {
  return c::guarded(
      [&] {
        if (!room->room->members().contains(member)) return c::no_such_member(error, error_size);
        // The message has floats. A double beyond them becomes infinite, which the room refuses.
        const Vec3f at = Vec3(place[0], place[1], place[2]).cast<float>();
        // A number that is too large stays invalid, as in hand_of().
        const auto number = static_cast<std::uint8_t>(std::min(hand, c::kNumberMax));
        return c::done_or_error(room->room->take_hold(member, number, at, static_cast<float>(radius_m)), error,
                                error_size);
      },
      error, error_size);
}

hairnet_error hairnet_let_go(hairnet_room* room, uint32_t member, uint32_t hand, hairnet_release release) {
  if (static_cast<unsigned>(release) > HAIRNET_UNPIN || hand >= kHandShapesMax) return HAIRNET_INVALID;
  if (!room->room->members().contains(member)) return HAIRNET_NOT_THERE;
  const auto number = static_cast<std::uint8_t>(hand);
  return room->room->let_go(member, number, static_cast<Release>(release)) ? HAIRNET_OK : HAIRNET_INVALID;
}

hairnet_error hairnet_set_props(hairnet_room* room, const hairnet_touch_body* props, size_t count,
                                const uint8_t* removed, size_t removed_count, char* error, size_t error_size) {
  return c::guarded(
      [&] {
        std::vector<wire::Prop> set;
        for (std::size_t i = 0; i < count; ++i) {
          const Result<TouchBody> body = c::body_of(props[i]);
          if (!body)
            return c::refuse(HAIRNET_INVALID, "prop " + std::to_string(i) + ": " + body.error(), error, error_size);
          set.push_back({body->key.number, body->shape, body->place, body->has_jumped});
        }
        std::vector<std::uint8_t> gone(removed, removed + removed_count);
        return c::done_or_error(room->room->set_props(std::move(set), std::move(gone)), error, error_size);
      },
      error, error_size);
}

size_t hairnet_get_props(const hairnet_room* room, hairnet_touch_body* props, size_t capacity) {
  std::size_t count = 0;
  for (const auto& [number, prop] : room->room->props()) {
    // Props beyond the capacity are only counted.
    if (count++ < capacity) *props++ = c::body_of(prop);
  }
  return count;
}

int32_t hairnet_may_set_props(const hairnet_room* room) {
  return room->room->may_set_props();
}
