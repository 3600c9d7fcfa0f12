#include "core/touch/hand.hpp"

#include <algorithm>
#include <cmath>

#include "core/assert.hpp"
#include "core/geometry/rigid_transform.hpp"
#include "core/geometry/rotation_between.hpp"

namespace hairnet {
namespace {

// A shape with a shorter axis is a sphere, since the axis has no direction.
constexpr double kAxisLeast_m = 1e-6;

// The body of one shape of a hand; append_bodies in hand.hpp says what its axes are.
TouchBody body_of(const Hand& hand, const HandShape& shape, const TouchKey& key) {
  const Vec3 axis = shape.to - shape.from;
  const double length_m = axis.norm();
  const bool is_sphere = !(length_m > kAxisLeast_m);
  TouchBody body{.key = key, .shape = capsule(is_sphere ? 0 : length_m / 2, shape.radius_m), .place = hand.place};
  body.shape.is_inside_out = shape.is_inside_out;
  body.has_jumped = hand.has_jumped;
  body.place.position = hand.place.point((shape.from + shape.to) / 2);
  if (!is_sphere) body.place.rotation = hand.place.rotation * rotation_between<double>(Vec3::UnitY(), axis);
  return body;
}

// Returns an empty string, or one line. The comparisons are written so that NaN fails.
std::string validate_shape(const HandShape& shape) {
  for (const Vec3& end : {shape.from, shape.to}) {
    if (!(end.allFinite() && end.cwiseAbs().maxCoeff() <= kHandSizeMax_m))
      return "hand: a shape is more than 10 m from its origin";
  }
  return shape.radius_m > 0 && shape.radius_m <= kHandSizeMax_m ? "" : "hand: a radius is not in (0, 10] m";
}

}  // namespace

std::string validate(const std::vector<Hand>& hands) {
  std::size_t next = 0;
  for (const Hand& hand : hands) {
    if (hand.shapes.empty()) return "hand: it has no shape";
    // Numbers that ascend without overlap name every shape of a person once.
    if (hand.first_number < next) return "hands: the numbers of their shapes do not ascend";
    next = hand.first_number + hand.shapes.size();
    if (next > kHandShapesMax) return "hands: more than " + std::to_string(kHandShapesMax) + " shapes";
    const Vec3& at = hand.place.position;
    if (!(at.allFinite() && at.cwiseAbs().maxCoeff() <= kHandPlaceMax_m))
      return "hand: a coordinate of its place is more than 10 000 m";
    if (!(std::abs(hand.place.rotation.norm() - 1) <= kTouchRotationTolerance))
      return "hand: its rotation is not of unit length";
    for (const HandShape& shape : hand.shapes) {
      if (std::string error = validate_shape(shape); !error.empty()) return error;
    }
  }
  return {};
}

const Hand* find_same(const Hand& hand, const std::vector<Hand>& hands) {
  const auto found = std::ranges::find(hands, hand.first_number, &Hand::first_number);
  return found != hands.end() && found->shapes.size() == hand.shapes.size() ? &*found : nullptr;
}

void move_towards(const std::vector<Hand>& to, double share, std::vector<Hand>& hands) {
  for (Hand& hand : hands) {
    const Hand* const next = find_same(hand, to);
    if (!next || next->has_jumped) continue;
    hand.place = interpolate(hand.place, next->place, share);
    hand.shapes = next->shapes;
  }
}

void append_bodies(const Hand& hand, ToucherId toucher, std::vector<TouchBody>& bodies) {
  std::uint8_t number = hand.first_number;
  for (const HandShape& shape : hand.shapes) {
    bodies.push_back(body_of(hand, shape, {toucher, number++}));
    HAIRNET_VALIDATE(validate(bodies.back()).empty());
  }
}

}  // namespace hairnet
