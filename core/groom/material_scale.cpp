#include "core/groom/material_scale.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "core/assert.hpp"
#include "core/gravity.hpp"
#include "core/number_range.hpp"

namespace hairnet {
namespace {

struct ScaleRange {
  const char* name;
  float MaterialScale::*value;
  float low, high;
};
// The ranges of what any client may ask for its own character. Steps assert a stiffness and a density above 0, so the
// lower limits of these two are above 0.
constexpr std::array<ScaleRange, 6> kRanges{{{"stiffness", &MaterialScale::stiffness, 0.01f, 100},
                                             {"damping", &MaterialScale::damping, 0, 100},
                                             {"density", &MaterialScale::density, 0.1f, 10},
                                             {"ether_damping", &MaterialScale::ether_damping, 0, 100},
                                             {"air_drag", &MaterialScale::air_drag, 0, 100},
                                             {"gel_per_s2", &MaterialScale::gel_per_s2, 0, 10'000}}};

// The factor from the built value to the wanted one. A built value of zero cannot be scaled, and stays zero.
float ratio(double wanted, double built) {
  return built > 0 ? static_cast<float>(wanted / built) : 1;
}

// q of springs without the factors of the strand itself: q = 2 zeta (2 / pi) L sqrt(rho / EA) k, k = EA / length of the
// spring.
double axial_damping(const Material& m) {
  return static_cast<double>(m.damping_ratio) *
         std::sqrt(static_cast<double>(m.linear_density_kg_per_m) * static_cast<double>(m.axial_stiffness_n));
}

// The ether's damping over mass, q_e / m = 2 zeta_e sqrt(k_e / m), at l = 0.2 m below the root. Its stiffness there is
// k_e / m = |g| / l + gel.
double ether_damping_over_mass(const Material& m, double gel_per_s2) {
  constexpr double kHang_m = 0.2;
  return 2 * static_cast<double>(m.ether_damping_ratio) * std::sqrt(kGravity_m_per_s2 / kHang_m + gel_per_s2);
}

}  // namespace

std::string validate(const MaterialScale& scale) {
  std::array<NumberRange, kRanges.size()> ranges;
  std::ranges::transform(kRanges, ranges.begin(), [&](const ScaleRange& range) {
    return NumberRange{range.name, double{scale.*range.value}, double{range.low}, double{range.high}};
  });
  const std::string error = out_of_range(ranges);
  return error.empty() ? error : "material scale " + error;
}

MaterialScale scale_between(const Material& built, const Material& wanted) {
  HAIRNET_VALIDATE(validate(built).empty());
  HAIRNET_VALIDATE(validate(wanted).empty());
  const auto gel_built = static_cast<double>(built.ether_stiffness_per_s2);
  const double gel = std::max(static_cast<double>(wanted.ether_stiffness_per_s2), gel_built);
  MaterialScale scale;
  scale.stiffness = ratio(wanted.axial_stiffness_n, built.axial_stiffness_n);
  scale.damping = ratio(axial_damping(wanted), axial_damping(built));
  scale.density = ratio(wanted.linear_density_kg_per_m, built.linear_density_kg_per_m);
  scale.ether_damping = ratio(ether_damping_over_mass(wanted, gel), ether_damping_over_mass(built, gel_built));
  scale.air_drag = ratio(wanted.air_drag_ns_per_m2, built.air_drag_ns_per_m2);
  scale.gel_per_s2 = static_cast<float>(gel - gel_built);
  for (const ScaleRange& range : kRanges) {
    float& value = scale.*range.value;
    value = std::clamp(value, range.low, range.high);
    // A number between 0 and kSmallest would fail validate().
    if (value < static_cast<float>(NumberRange::kSmallest)) value = 0;
  }
  HAIRNET_ASSERT(validate(scale).empty());
  return scale;
}

}  // namespace hairnet
