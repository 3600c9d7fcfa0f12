#pragma once

#include <string>

#include "core/groom/material.hpp"

namespace hairnet {

// Changes the material of one character at run time: factors on the values that its levels were built with, and added
// gel. The design stays the equilibrium and the lattice state does not change, so the hair does not jump. The client
// applies a change of the root length when it draws; a change of thickness needs a new build.
struct MaterialScale {
  // How strongly springs and attachments resist stretching: stiff hair keeps its shape. 0.01 to 100.
  float stiffness = 1;
  // How fast springs and attachments stop swinging. 0 to 100.
  float damping = 1;
  // All mass, and with it the ether's pull, which replaces the tension of hanging hair: heavy hair yields less to the
  // air. 0.1 to 10.
  float density = 1;
  // How fast hair as a whole stops swinging about its design, in addition to density's effect. 0 to 100.
  float ether_damping = 1;
  // How strongly air and wind take hair along. 0 to 100.
  float air_drag = 1;
  // Gel holds hair at its design: this is added to the built ether stiffness over mass. 0 to 10 000.
  float gel_per_s2 = 0;

  friend bool operator==(const MaterialScale&, const MaterialScale&) = default;
};

// Returns an empty string when every value is finite and in its range above; else one line that names the value and the
// range.
std::string validate(const MaterialScale& scale);

// The scale that makes hair built with the material `built` behave like `wanted`. It is exact for springs, mass and
// drag. Attachments use the springs' factor. Ether damping is exact 0.2 m below the root, a usual place of hair, and
// nearly so elsewhere: one factor cannot be exact everywhere, as the ether's stiffness depends on the distance from the
// root. Gel cannot be reduced below the built value. All results are in range.
MaterialScale scale_between(const Material& built, const Material& wanted);

}  // namespace hairnet
