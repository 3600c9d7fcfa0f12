#include <algorithm>

#include "client/tools/groom/commands.hpp"

namespace hairnet::groom {
namespace {

Result<std::uint16_t> group_of(const Groom& groom, const std::string& name) {
  const auto found = std::ranges::find(groom.group_names, name);
  if (found != groom.group_names.end()) return static_cast<std::uint16_t>(found - groom.group_names.begin());
  std::string known;
  // The error lists the names that exist.
  for (const std::string& n : groom.group_names) known += (known.empty() ? "" : ", ") + n;
  return Refusal("no group is called '" + name + "': there are " + known);
}

}  // namespace

Result<void> apply_materials(const MaterialOptions& options, Groom& groom) {
  if (options.material) set_material(*options.material, groom);
  for (const auto& [name, material] : options.group_materials) {
    const Result<std::uint16_t> group = group_of(groom, name);
    if (!group) return Refusal("--group-material: " + group.error());
    set_group_material(*group, material, groom);
  }
  return {};
}

}  // namespace hairnet::groom
