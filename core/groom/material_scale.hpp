#pragma once

#include <string>

namespace hairnet {

// What one character changes while it runs in the material that its levels were built with: factors, and added gel. The
// design stays the equilibrium and the state stays as it is, so nothing jumps. A character's own scale goes into every
// step; changing lambda_0 is up to who draws, changing the thickness takes another build.
struct MaterialScale {
  float stiffness = 1;      // of springs and attachments, k
  float damping = 1;        // of springs and attachments, q
  float density = 1;        // of all mass, and of the ether that stands in for the tension of hanging mass
  float ether_damping = 1;  // of q_e
  float air_drag = 1;       // of Q
  float gel_per_s2 = 0;     // ether stiffness over mass, added to what was built

  friend bool operator==(const MaterialScale&, const MaterialScale&) = default;
};

// Empty when every value is finite and in its stated range; else one line that names the value and the range.
std::string validate(const MaterialScale& scale);

}  // namespace hairnet
