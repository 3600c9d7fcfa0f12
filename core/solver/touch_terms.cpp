#include "core/solver/touch_terms.hpp"

#include <type_traits>

#include "core/assert.hpp"

namespace hairnet {
namespace {

static_assert(std::is_trivially_copyable_v<BodyTerms> && sizeof(BodyTerms) % sizeof(float) == 0);
static_assert(std::is_trivially_copyable_v<HoldTerms> && sizeof(HoldTerms) % sizeof(float) == 0);

// The near_m of a shape that is inside out: hair is always near what it is inside of.
constexpr float kAlwaysNear_m = 1e6f;

}  // namespace

BodyTerms body_terms(const StepInput& input, const StepBody& body) {
  HAIRNET_VALIDATE(validate(body.shape).empty());
  HAIRNET_ASSERT(body.friction >= 0);
  BodyTerms terms;
  put(body.from.inverse() * input.from.head(), terms.to_body_before);
  put(body.to.inverse() * input.to.head(), terms.to_body);
  // The ball about the centre at the start also covers the centre's way to the end, both seen from the head.
  const Vec3 centre = input.from.head().inverse().point(body.from.position);
  const Vec3 moved = input.to.head().inverse().point(body.to.position) - centre;
  put(centre, terms.centre);
  terms.near_m = body.shape.is_inside_out
                     ? kAlwaysNear_m
                     : static_cast<float>(bounding_radius(body.shape) + kTouchReach_m + moved.norm());
  put(body.shape.half_size_m, terms.half_size);
  terms.radius_m = static_cast<float>(body.shape.radius_m);
  terms.side = body.shape.is_inside_out ? -1.0f : 1.0f;
  terms.friction = static_cast<float>(body.friction);
  return terms;
}

HoldTerms hold_terms(const StepInput& input, const StepHold& hold) {
  HAIRNET_ASSERT(hold.from.allFinite());
  HAIRNET_ASSERT(hold.to.allFinite());
  HoldTerms terms;
  // Terms are floats only; a level has far fewer contact points than the 2^24 whole numbers that a float has.
  terms.point = static_cast<float>(hold.point);
  put(input.from.head().inverse().point(hold.from), terms.from);
  put(input.to.head().inverse().point(hold.to), terms.to);
  return terms;
}

std::size_t body_count(const StepInput& input) {
  const std::size_t count = input.touch ? input.touch->bodies.size() : 0;
  HAIRNET_ASSERT(count <= kStepBodiesMax);
  return count;
}

std::size_t hold_count(const StepInput& input) {
  const std::size_t count = input.touch ? input.touch->holds.size() : 0;
  HAIRNET_ASSERT(count <= kStepHoldsMax);
  return count;
}

}  // namespace hairnet
