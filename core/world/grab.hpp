#pragma once

#include "core/touch/touch_body.hpp"

namespace hairnet {

// A hand takes hold of hair: all of a character's contact points within `radius_m` of a place on one of its shapes.
struct Grab {
  TouchKey hand;
  // The place about which hair is taken, in own axes of the hand's shape, m.
  Vec3 place = Vec3::Zero();
  double radius_m = 0.03;
};

// The greatest radius that World::grab accepts.
inline constexpr double kGrabRadiusMax_m = 0.3;

// How a hand lets go of the hair that it holds. `pin` leaves it where it is on the head until `unpin`, which ends all
// pins of that toucher, or of everyone when the toucher owns the character.
enum class Release : std::uint8_t { drop, pin, unpin };

}  // namespace hairnet
