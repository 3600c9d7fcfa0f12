#pragma once

#include <string>

#include "core/groom/material.hpp"

namespace hairnet {

// Changes the material of one character at run time: factors on the values that its levels were built with, and added
// gel. The design stays the equilibrium and the lattice state does not change, so the hair does not jump. The client
// applies a change of lambda_0 when it draws; a change of thickness needs a new build.
struct MaterialScale {
  // These scale the k and the q of springs and attachments.
  float stiffness = 1;
  float damping = 1;
  // Scales all mass, and the ether that replaces the tension of hanging mass.
  float density = 1;
  // Scales q_e, in addition to density's effect.
  float ether_damping = 1;
  // Scales Q.
  float air_drag = 1;
  // Adds ether stiffness over mass to the built value.
  float gel_per_s2 = 0;

  friend bool operator==(const MaterialScale&, const MaterialScale&) = default;
};

// Returns an empty string when every value is finite and in its stated range; else one line that names the value and
// the range.
std::string validate(const MaterialScale& scale);

// The scale that makes hair built with the material `built` behave like `wanted`. It is exact for springs, mass and
// drag. Attachments use the springs' factor. Ether damping is exact 0.2 m below the root and close to it elsewhere. Gel
// cannot be reduced below the built value. All results are in range.
MaterialScale scale_between(const Material& built, const Material& wanted);

}  // namespace hairnet
