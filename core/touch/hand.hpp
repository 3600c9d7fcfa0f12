#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "core/touch/touch_body.hpp"

namespace hairnet {

// A sphere, or a capsule between two points; own axes of its hand, m.
struct HandShape {
  // Both are equal for a sphere.
  Vec3 from = Vec3::Zero(), to = Vec3::Zero();
  double radius_m = 0;
  // Hair is kept within it, not outside.
  bool is_inside_out = false;
  friend bool operator==(const HandShape&, const HandShape&) = default;
};

// Shapes that move together: a hand, a controller, a brush.
struct Hand {
  // The hand's shapes have the numbers from here on, among the shapes of one person.
  std::uint8_t first_number = 0;
  // The rigid transform from the hand's own axes to the world, m.
  RigidTransform place;
  // The hand appears at this place and has not moved there, so it sweeps no hair along.
  bool has_jumped = false;
  std::vector<HandShape> shapes = {};
};

// All hands of a person have at most so many shapes.
inline constexpr std::size_t kHandShapesMax = 32;
// The greatest radius, and the greatest coordinate of a shape's ends in the hand's own axes.
inline constexpr double kHandSizeMax_m = 10;
// The greatest coordinate of a hand's place in the world.
inline constexpr double kHandPlaceMax_m = 10'000;

// Returns an empty string when valid: each hand has a shape, the numbers ascend from hand to hand and are below
// kHandShapesMax, sizes and places keep to these limits, and rotations are of unit length to 1e-3; else one line.
std::string validate(const std::vector<Hand>& hands);

// Returns the hand with the same number and count of shapes; null: there is none.
const Hand* find_same(const Hand& hand, const std::vector<Hand>& hands);

// Moves each hand by a share, in [0, 1], of its way to where `to` has the same hand, whose shapes it gets. A hand that
// `to` lacks, or that jumps there, stays.
void move_towards(const std::vector<Hand>& to, double share, std::vector<Hand>& hands);

// Appends a hand's shapes as bodies of the one who touches. A body's axes are the hand's, with y turned the shortest
// way into the axis of the capsule (half a turn about z into the opposite one), and its origin is the capsule's middle.
// Asserts that the hand is valid.
void append_bodies(const Hand& hand, ToucherId toucher, std::vector<TouchBody>& bodies);

}  // namespace hairnet
