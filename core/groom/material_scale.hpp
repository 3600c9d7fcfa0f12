#pragma once

#include <string>

#include "core/groom/material.hpp"

namespace hairnet {

// A change of material of one character while it lives: factors on what was built, so that levels stay shared. The
// default changes nothing.
struct MaterialScale {
  float stiffness = 1;      // k of springs and attachments
  float damping = 1;        // q of springs and attachments
  float density = 1;        // mass, and with it the ether's stiffness, which stands in for hanging
  float ether_damping = 1;  // q of the ether
  float air_drag = 1;       // Q of eq. 6
  float gel_per_s2 = 0;     // ether stiffness over mass, added
  friend bool operator==(const MaterialScale&, const MaterialScale&) = default;
};

// What a factor may be, and the gel. Solving in 8 to 16 iterations stands a stiffness about fifty times the default's.
inline constexpr float kScaleMin = 0.02f, kScaleMax = 50;
inline constexpr float kGelMax_per_s2 = 1e4f;

// Empty when every value is finite and in its range; else one line that names the value and the range.
std::string validate(const MaterialScale& scale);

// What turns hair built of one material into about the other: exact for springs, mass and drag; the attachments go with
// the springs' stiffness; the ether's damping is that of hair 0.2 m below its root. Root length and thickness are built
// in, and so is gel: hair built with more of it than wanted keeps it. Values are kept within their ranges.
MaterialScale scale_between(const Material& built, const Material& wanted);

}  // namespace hairnet
