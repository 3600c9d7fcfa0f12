#include "core/touch/touch_body.hpp"

#include <cmath>

namespace hairnet {
namespace {

// A hand in the farthest corner of its range (kHandPlaceMax_m on each axis) is within it, with all its shapes.
constexpr double kPlaceMax_m = 20'000;

}  // namespace

std::string validate(const TouchBody& body) {
  if (std::string error = validate(body.shape); !error.empty()) return error;
  // Written so that NaN fails.
  if (!(body.place.position.norm() <= kPlaceMax_m)) return "body: its place is not within 20 km";
  if (!(std::abs(body.place.rotation.norm() - 1) <= kTouchRotationTolerance))
    return "body: its rotation is not of unit length";
  return {};
}

}  // namespace hairnet
