#pragma once

#include <string>

namespace hairnet {

// What the hair is made of, in real units, per real hair where it says so (StrandProperties::hair_count multiplies).
// Defaults are model.md's for strands of 50 hairs, divided by 50.
struct Material {
  float axial_stiffness_n = 4e-4f;             // per hair; a spring of length L has k = this / L (eq. 3)
  float spring_damping_time_s = 0.008f;        // q / k of springs
  float attachment_stiffness_n_per_m = 6e-3f;  // per hair (eq. 4)
  float attachment_damping_time_s = 0.010f;    // q / k of attachments
  float linear_density_kg_per_m = 6.6e-6f;     // per hair
  float air_drag_ns_per_m2 = 1e-5f;            // per hair: q of the drag tensor (eq. 6)
  float ether_mass_ratio = 0.5f;               // ether mass over hair mass
  float ether_stiffness_n_per_m = 0.0f;        // total over the groom, shared by mass; never below free hanging
  float ether_damping_time_s = 0.06f;          // q_e / k_e
  float thickness_m = 0.006f;                  // hair keeps this far off the skin
  float metaball_potential_j = 0.03f;          // least U of a metaball; raised where a load needs more
};

// Empty when every value is finite and in its stated range; else one line that names the value and the range.
std::string validate(const Material& material);

}  // namespace hairnet
