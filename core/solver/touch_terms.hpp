#pragma once

#include "core/solver/step.hpp"
#include "core/solver/step_terms.hpp"

namespace hairnet {

// One body of a character's step for the kernels, as floats alone like StepTerms. The default body is farther away than
// any hair: its radius is negative.
struct BodyTerms {
  // They map a point of head space at the step's start, and at its end, to the shape's own axes.
  StepTerms::AffineMap to_body_before, to_body;
  // The shape's origin at the start, head space, m.
  float centre[3] = {};
  // A hair point at rest that is farther from `centre` than this cannot meet the shape in this step.
  float near_m = 0;
  float half_size[3] = {};  // m
  float radius_m = -1e6f;
  // The sign of distances: -1 for a shape that is inside out.
  float side = 1;
  float friction = 0;
};
inline constexpr std::size_t kBodyTermCount = sizeof(BodyTerms) / sizeof(float);

// One held point of a character's step for the kernels.
struct HoldTerms {
  // The number of the contact point, which a float holds exactly.
  float point = 0;
  // The places where the point is bound to at the start and at the end, head space, m.
  float from[3] = {}, to[3] = {};
};
inline constexpr std::size_t kHoldTermCount = sizeof(HoldTerms) / sizeof(float);

// Each asserts finite and valid numbers.
BodyTerms body_terms(const StepInput& input, const StepBody& body);
HoldTerms hold_terms(const StepInput& input, const StepHold& hold);

// The bodies and the holds of a step; 0 without touch. They assert that the counts are in their limits
// (step_touch.hpp).
std::size_t body_count(const StepInput& input);
std::size_t hold_count(const StepInput& input);

}  // namespace hairnet
