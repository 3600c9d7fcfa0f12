#pragma once

#include <cstddef>
#include <string_view>

#include "core/pose/motion.hpp"
#include "core/result.hpp"

namespace hairnet::viewer {

// Where a character stands and where it looks: x and z on the floor, and a turn about +Y (0: along +Z). Its height is
// that of its motion.
struct Place {
  double x_m = 0, z_m = 0, heading_deg = 0;
  friend bool operator==(const Place&, const Place&) = default;
};

// Parses "X:Z" or "X:Z:HEADING_DEG", m and degrees, each within 1000.
Result<Place> parse_place(std::string_view text);

// The place of character `n` of `count` without given places: side by side, 0.7 m apart, about the origin; more than
// eight in rows behind each other.
Place side_by_side(std::size_t n, std::size_t count);

// Moves a pose or a whole motion at the origin to the place, world. The turn comes first, about the world's origin.
Pose placed(const Place& place, const Pose& pose);
void move_to(const Place& place, Motion& motion);

}  // namespace hairnet::viewer
