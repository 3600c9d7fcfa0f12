#pragma once

#include <compare>
#include <cstdint>
#include <string>

#include "core/touch/touch_shape.hpp"

namespace hairnet {

// The number of someone who touches hair: a person, or the room itself, which has its props.
using ToucherId = std::uint32_t;
inline constexpr ToucherId kRoomToucher = 0;

// Names one shape of one toucher. The number is the toucher's own.
struct TouchKey {
  ToucherId toucher = kRoomToucher;
  std::uint8_t number = 0;
  friend auto operator<=>(const TouchKey&, const TouchKey&) = default;
};

// A shape in a room at the end of a tick: a hand's, or a prop's.
struct TouchBody {
  TouchKey key;
  TouchShape shape;
  // The rigid transform from the shape's own axes to the world, m.
  RigidTransform place;
  // The body appears at this place and has not moved there, so it sweeps no hair along.
  bool has_jumped = false;
  // The body touches only characters of its own toucher, whoever else allows it.
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
