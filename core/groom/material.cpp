#include "core/groom/material.hpp"

#include <array>
#include <cmath>

namespace hairnet {

std::string validate(const Material& material) {
  struct Range {
    const char* name;
    float value, least, most;
  };
  const std::array<Range, 11> ranges{{
      {"axial stiffness (N per hair)", material.axial_stiffness_n, 0, 10},
      {"spring damping time (s)", material.spring_damping_time_s, 0, 1},
      {"attachment stiffness (N/m per hair)", material.attachment_stiffness_n_per_m, 0, 100},
      {"attachment damping time (s)", material.attachment_damping_time_s, 0, 1},
      {"linear density (kg/m per hair)", material.linear_density_kg_per_m, 1e-8f, 1e-2f},
      {"air drag (N s/m^2 per hair)", material.air_drag_ns_per_m2, 0, 1},
      {"ether mass ratio", material.ether_mass_ratio, 1e-3f, 100},
      {"ether stiffness (N/m)", material.ether_stiffness_n_per_m, 0, 1e6f},
      {"ether damping time (s)", material.ether_damping_time_s, 0, 10},
      {"thickness (m)", material.thickness_m, 0, 0.1f},
      {"metaball potential (J)", material.metaball_potential_j, 0, 100},
  }};
  for (const Range& range : ranges) {
    if (!(range.value >= range.least && range.value <= range.most)) {
      return std::string(range.name) + " is " + std::to_string(range.value) + ", not in [" +
             std::to_string(range.least) + ", " + std::to_string(range.most) + ']';
    }
  }
  return {};
}

}  // namespace hairnet
