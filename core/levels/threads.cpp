#include "core/levels/threads.hpp"

#include "core/assert.hpp"

namespace hairnet {

ThreadAsStrand::ThreadAsStrand(const Thread& thread, const Material& base, std::uint16_t group) : material(base) {
  HAIRNET_ASSERT(thread.linear_density_kg_per_m > 0);
  HAIRNET_ASSERT(thread.axial_stiffness_n >= 0);
  properties.hair_count = 1;
  properties.group = group;
  properties.rooted = thread.rooted;
  material.axial_stiffness_n = thread.axial_stiffness_n;
  material.attachment_stiffness_n_per_m = thread.pin_stiffness_n_per_m;
  material.linear_density_kg_per_m = thread.linear_density_kg_per_m;
  material.air_drag_ns_per_m2 = thread.air_drag_ns_per_m2;
}

}  // namespace hairnet
