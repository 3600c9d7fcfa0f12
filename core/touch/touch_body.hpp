#pragma once

#include <compare>
#include <cstdint>
#include <string>

#include "core/touch/touch_shape.hpp"

namespace hairnet {

// Names who touches. The room itself has its props.
using ToucherId = std::uint32_t;
inline constexpr ToucherId kRoomToucher = 0;

// Names one shape of one toucher.
struct TouchKey {
  ToucherId toucher = kRoomToucher;
  std::uint8_t number = 0;
  friend auto operator<=>(const TouchKey&, const TouchKey&) = default;
};

// A shape in a room at the end of a tick: a hand's, or a prop's.
struct TouchBody {
  TouchKey key;
  TouchShape shape;
  // Maps the shape's own axes to the world; rigid, metres.
  RigidTransform place;
  // Says that the body has not moved to this place but appears here, so it does not sweep hair along.
  bool has_jumped = false;
  // Says that the body touches only characters of its own toucher, whoever else allows it.
  bool only_own = false;
};

// A body that moves faster has jumped: no hand strokes hair at such a speed, and no step could follow it.
inline constexpr double kTouchSpeedMax_m_per_s = 8;

// The length of a rotation may err by this much.
inline constexpr double kTouchRotationTolerance = 1e-3;

// Returns an empty string when valid: a valid shape, and a finite place within 20 km with a rotation of unit length to
// 1e-3; else one line.
std::string validate(const TouchBody& body);

}  // namespace hairnet
