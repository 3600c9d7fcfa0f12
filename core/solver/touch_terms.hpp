#pragma once

#include "core/solver/step.hpp"
#include "core/solver/step_terms.hpp"

namespace hairnet {

// One body and one held point of a character's step for the kernels. Only floats, as StepTerms. The default body is
// farther away than any hair.
struct BodyTerms {
  // Map a point of head space, at the start and at the end, to the shape's own axes.
  StepTerms::AffineMap to_body_before, to_body;
  // Is the shape's origin at the start, head space, m.
  float centre[3] = {};
  // Bounds the distance from the centre at which a point at rest may meet the shape.
  float near_m = 0;
  float half_size[3] = {};  // m
  float radius_m = -1e6f;
  // Is -1 for a shape that is inside out.
  float side = 1;
  float friction = 0;
};
inline constexpr std::size_t kBodyTermCount = sizeof(BodyTerms) / sizeof(float);

struct HoldTerms {
  // Is the number of the contact point, which a float holds exactly.
  float point = 0;
  // Are the places where the point is bound to at the start and at the end, head space, m.
  float from[3] = {}, to[3] = {};
};
inline constexpr std::size_t kHoldTermCount = sizeof(HoldTerms) / sizeof(float);

// Each asserts finite and valid numbers.
BodyTerms body_terms(const StepInput& input, const StepBody& body);
HoldTerms hold_terms(const StepInput& input, const StepHold& hold);

// Of a step; 0 without touch. They assert that the counts are in their limits.
std::size_t body_count(const StepInput& input);
std::size_t hold_count(const StepInput& input);

}  // namespace hairnet
