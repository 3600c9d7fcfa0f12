#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/result.hpp"

namespace hairnet {

// What the hair is made of, in real units. Values marked "per hair" are multiplied by StrandProperties::hair_count.
// Real hair has an axial stiffness of 20 N; the defaults are much lower because they must suit a truncated solve.
//
// Damping is a ratio of the critical damping of the slowest oscillation that it acts on, so hair of any length and
// stiffness is damped alike: at 0 it never stops, at 1 it returns without overshoot.
struct Material {
  // The axial stiffness E A, per hair. A spring of length L has k = E A / L (eq. 3).
  float axial_stiffness_n = 4e-4f;
  // The stiffness of a strand's attachment (eq. 4), per hair.
  float attachment_stiffness_n_per_m = 6e-3f;
  // The damping of springs and attachments, as a ratio for the strand's first axial mode.
  float damping_ratio = 0.16f;
  // The mass a metre, rho, per hair.
  float linear_density_kg_per_m = 6.6e-6f;
  // The drag coefficient q of eq. 6, per hair.
  float air_drag_ns_per_m2 = 1e-5f;
  // The ether mass over the hair mass.
  float ether_mass_ratio = 0.5f;
  // Gel: a stiffness over mass, which is added to the ether stiffness of freely hanging hair.
  float ether_stiffness_per_s2 = 0;
  // The damping of each node's oscillation about its design, as a ratio.
  float ether_damping_ratio = 0.2f;
  // The root length lambda_0 of eq. 7, for strands with this material.
  float root_length_m = 0.02f;
  // Hair stays this far from the skin.
  float thickness_m = 0.006f;
  // The potential of contact: twice the value is twice as hard.
  float metaball_potential_j = 0.03f;
  friend bool operator==(const Material&, const Material&) = default;
};

// Returns an empty string when every value is finite and in its stated range; else one line that names the value and
// the range.
std::string validate(const Material& material);

// The time q / k of the springs and the attachment of one strand, s. Its first axial mode, a quarter wave, has omega =
// (pi / 2) / L sqrt(E A / rho), and a ratio zeta of its critical damping gives q / k = 2 zeta / omega.
double axial_damping_time_s(const Material& material, double strand_length_m);

// Named materials, chosen by eye and by figures. `normal` is Material{}.
std::span<const std::string_view> material_names();
// An unknown name gives an error that lists the known ones.
Result<Material> make_material(std::string_view name);
// Returns "custom" when the material has no name.
std::string_view material_name(const Material& material);

// The material of one group of a groom.
struct GroupMaterial {
  // An index into Groom::group_names.
  std::uint16_t group = 0;
  Material material;
  friend bool operator==(const GroupMaterial&, const GroupMaterial&) = default;
};
// A groom's materials: one for the whole groom, and others for some of its groups. Thickness and metaball potential
// come from the base only, because groups share nodes.
struct MaterialSet {
  Material base;
  // The materials of groups that have their own, ascending by group.
  std::vector<GroupMaterial> groups;

  [[nodiscard]] const Material& of(std::uint16_t group) const;
  // Replaces the group's own, if it has one.
  void set(std::uint16_t group, const Material& material);
  friend bool operator==(const MaterialSet&, const MaterialSet&) = default;
};

// Returns an empty string when valid for a groom of that many groups; else one line.
std::string validate(const MaterialSet& materials, std::size_t group_count);

}  // namespace hairnet
