#include "core/groom/material_scale.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace hairnet {
namespace {

constexpr double kHangingPerS2 = 9.81 / 0.2;  // |g| / l

float factor(double built, double wanted) {
  if (built == wanted) return 1;
  // What was built without can only be as much of nothing as possible.
  if (!(built > 0)) return kScaleMax;
  return std::clamp(static_cast<float>(wanted / built), kScaleMin, kScaleMax);
}

// q / zeta of springs, but for the strand's own: q = 2 zeta (2 / pi) L sqrt(rho / EA) EA / L.
double axial_damping(const Material& m) {
  return static_cast<double>(m.damping_ratio) *
         std::sqrt(static_cast<double>(m.linear_density_kg_per_m) * static_cast<double>(m.axial_stiffness_n));
}

// q_e = 2 zeta_e sqrt(k_e m), k_e = m (|g| / l + gel)
double ether_damping(const Material& m, double gel_per_s2) {
  return static_cast<double>(m.ether_damping_ratio) * static_cast<double>(m.linear_density_kg_per_m) *
         std::sqrt(kHangingPerS2 + gel_per_s2);
}

}  // namespace

std::string validate(const MaterialScale& scale) {
  struct Range {
    const char* name;
    float value, least, most;
  };
  const std::array<Range, 6> ranges{{
      {"stiffness factor", scale.stiffness, kScaleMin, kScaleMax},
      {"damping factor", scale.damping, kScaleMin, kScaleMax},
      {"density factor", scale.density, kScaleMin, kScaleMax},
      {"ether damping factor", scale.ether_damping, kScaleMin, kScaleMax},
      {"air drag factor", scale.air_drag, kScaleMin, kScaleMax},
      {"gel (1/s^2)", scale.gel_per_s2, 0, kGelMax_per_s2},
  }};
  for (const Range& range : ranges) {
    if (!(range.value >= range.least && range.value <= range.most)) {
      return std::string(range.name) + " is " + std::to_string(range.value) + ", not in [" +
             std::to_string(range.least) + ", " + std::to_string(range.most) + ']';
    }
  }
  return {};
}

MaterialScale scale_between(const Material& built, const Material& wanted) {
  const auto gel_built = static_cast<double>(built.ether_stiffness_per_s2);
  const double gel = std::max(static_cast<double>(wanted.ether_stiffness_per_s2), gel_built);
  MaterialScale scale;
  scale.stiffness = factor(built.axial_stiffness_n, wanted.axial_stiffness_n);
  scale.damping = factor(axial_damping(built), axial_damping(wanted));
  scale.density = factor(built.linear_density_kg_per_m, wanted.linear_density_kg_per_m);
  scale.ether_damping = factor(ether_damping(built, gel_built), ether_damping(wanted, gel));
  scale.air_drag = factor(built.air_drag_ns_per_m2, wanted.air_drag_ns_per_m2);
  scale.gel_per_s2 = std::min(static_cast<float>(gel - gel_built), kGelMax_per_s2);
  return scale;
}

}  // namespace hairnet
