#include "core/groom/material.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "core/assert.hpp"
#include "core/number_range.hpp"

namespace hairnet {
namespace {

constexpr std::array<std::string_view, 5> kNames{"soft", "normal", "stiff", "gelled", "wet"};

// Fine hair of 0.06 mm instead of 0.08 mm: about half the cross-section, so half the stiffness and mass, but nearly the
// same drag, which in slow air hardly depends on thickness. It flies and sways.
Material make_soft() {
  Material m;
  m.axial_stiffness_n = 2e-4f;
  m.attachment_stiffness_n_per_m = 4e-3f;
  m.damping_ratio = 0.12f;
  m.linear_density_kg_per_m = 3.8e-6f;
  m.air_drag_ns_per_m2 = 0.95e-5f;
  m.ether_damping_ratio = 0.15f;
  m.root_length_m = 0.012f;
  m.thickness_m = 0.005f;
  return m;
}

// Coarse hair of 0.1 mm: more mass, and more bending stiffness, which grows with the fourth power of thickness. The
// lattice's only stiffness against bending is the ether's; a longer part of the hair stands with its root.
Material make_stiff() {
  Material m;
  m.axial_stiffness_n = 2e-3f;
  m.attachment_stiffness_n_per_m = 2e-2f;
  m.linear_density_kg_per_m = 1e-5f;
  m.air_drag_ns_per_m2 = 1.05e-5f;
  m.ether_stiffness_per_s2 = 40;
  m.ether_damping_ratio = 0.25f;
  m.root_length_m = 0.03f;
  m.thickness_m = 0.008f;
  return m;
}

// Strands glued to each other: ether keeps the style in one piece, and its inside is out of the wind.
Material make_gelled() {
  Material m;
  m.axial_stiffness_n = 1e-3f;
  m.attachment_stiffness_n_per_m = 2e-2f;
  m.damping_ratio = 0.3f;
  m.linear_density_kg_per_m = 8e-6f;
  m.air_drag_ns_per_m2 = 0.5e-5f;
  m.ether_stiffness_per_s2 = 400;
  m.ether_damping_ratio = 0.6f;
  m.root_length_m = 0.04f;
  return m;
}

// Water nearly doubles the mass, and draws hair into clumps, each with little more drag than one hair. It damps their
// rubbing, and lets them lie close to the skin. Wet keratin is softer.
Material make_wet() {
  Material m;
  m.axial_stiffness_n = 3e-4f;
  m.damping_ratio = 0.5f;
  m.linear_density_kg_per_m = 1.2e-5f;
  m.air_drag_ns_per_m2 = 0.3e-5f;
  m.ether_damping_ratio = 0.5f;
  m.thickness_m = 0.004f;
  return m;
}

const std::array<Material, kNames.size()>& named_materials() {
  static const std::array<Material, kNames.size()> materials{make_soft(), Material{}, make_stiff(), make_gelled(),
                                                             make_wet()};
  return materials;
}

}  // namespace

std::string validate(const Material& material) {
  // Each has the value's name with its unit, the value, and the least and the most that it may be.
  const std::array<NumberRange, 11> ranges{{
      {"axial stiffness (N per hair)", material.axial_stiffness_n, 0, 10},
      {"attachment stiffness (N/m per hair)", material.attachment_stiffness_n_per_m, 0, 100},
      {"damping ratio", material.damping_ratio, 0, 10},
      {"linear density (kg/m per hair)", material.linear_density_kg_per_m, 1e-8f, 1e-2f},
      {"air drag (N s/m^2 per hair)", material.air_drag_ns_per_m2, 0, 1},
      {"ether mass ratio", material.ether_mass_ratio, 1e-3f, 100},
      {"ether stiffness (1/s^2)", material.ether_stiffness_per_s2, 0, 1e5},
      {"ether damping ratio", material.ether_damping_ratio, 0, 10},
      {"root length (m)", material.root_length_m, 0, 10},
      {"thickness (m)", material.thickness_m, 0, 0.1f},
      {"metaball potential (J)", material.metaball_potential_j, 0, 100},
  }};
  return out_of_range(ranges);
}

double axial_damping_time_s(const Material& material, double strand_length_m) {
  const double axial_stiffness_n = material.axial_stiffness_n;
  // Without stiffness there is no axial mode to damp.
  if (!(axial_stiffness_n > 0)) return 0;
  HAIRNET_ASSERT(strand_length_m > 0);
  HAIRNET_ASSERT(material.linear_density_kg_per_m > 0);
  const double omega = std::numbers::pi / 2 / strand_length_m *
                       std::sqrt(axial_stiffness_n / static_cast<double>(material.linear_density_kg_per_m));
  return 2 * static_cast<double>(material.damping_ratio) / omega;
}

std::span<const std::string_view> material_names() {
  return kNames;
}

Result<Material> make_material(std::string_view name) {
  const auto found = std::ranges::find(kNames, name);
  if (found != kNames.end()) return named_materials()[static_cast<std::size_t>(found - kNames.begin())];
  // The message lists all names, since the name comes from a person.
  std::string known;
  for (const std::string_view n : kNames) known += (known.empty() ? "" : ", ") + std::string(n);
  return Refusal("no material is called '" + std::string(name) + "': there are " + known);
}

std::string_view material_name(const Material& material) {
  const auto found = std::ranges::find(named_materials(), material);
  return found == named_materials().end() ? "custom"
                                          : kNames[static_cast<std::size_t>(found - named_materials().begin())];
}

const Material& MaterialSet::of(std::uint16_t group) const {
  HAIRNET_VALIDATE(std::ranges::is_sorted(groups, {}, &GroupMaterial::group));
  const auto found = std::ranges::lower_bound(groups, group, {}, &GroupMaterial::group);
  return found != groups.end() && found->group == group ? found->material : base;
}

void MaterialSet::set(std::uint16_t group, const Material& material) {
  const auto at = std::ranges::lower_bound(groups, group, {}, &GroupMaterial::group);
  if (at != groups.end() && at->group == group) {
    at->material = material;
  } else {
    groups.insert(at, {group, material});
  }
  HAIRNET_VALIDATE(std::ranges::is_sorted(groups, {}, &GroupMaterial::group));
  HAIRNET_VALIDATE(std::ranges::count(groups, group, &GroupMaterial::group) == 1);
}

std::string validate(const MaterialSet& materials, std::size_t group_count) {
  if (std::string error = validate(materials.base); !error.empty()) return "material: " + error;
  for (std::size_t i = 0; i < materials.groups.size(); ++i) {
    const GroupMaterial& own = materials.groups[i];
    const std::string at = "material of group " + std::to_string(own.group) + ": ";
    if (own.group >= group_count) return at + "that group does not exist";
    if (i > 0 && own.group <= materials.groups[i - 1].group) return at + "groups are not ascending";
    if (std::string error = validate(own.material); !error.empty()) return at + error;
  }
  return {};
}

}  // namespace hairnet
