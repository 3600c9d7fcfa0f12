#pragma once

#include <cstddef>
#include <string_view>

#include "core/pose/motion.hpp"
#include "core/result.hpp"

namespace hairnet::viewer {

// Where a character stands and where it looks: x and z on the floor, and a turn about +Y (0: along +Z).
struct Place {
  double x_m = 0, z_m = 0, heading_deg = 0;
  friend bool operator==(const Place&, const Place&) = default;
};

// "X:Z" or "X:Z:HEADING_DEG".
Result<Place> parse_place(std::string_view text);

// Of character `n` of `count` that were given none: side by side, 0.7 m apart, about the origin; more than eight in
// rows behind each other.
Place side_by_side(std::size_t n, std::size_t count);

// `pose` as it is about the origin, at the place.
Pose placed(const Place& place, const Pose& pose);
void move_to(const Place& place, Motion& motion);

}  // namespace hairnet::viewer
