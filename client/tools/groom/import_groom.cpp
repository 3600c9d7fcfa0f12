#include <filesystem>

#include "client/files/write_file.hpp"
#include "client/tools/groom/commands.hpp"
#include "client/tools/groom/save_groom.hpp"
#include "core/groom/root_lengths.hpp"

namespace hairnet::groom {
namespace {

void spread_root_lengths(const ImportOptions& options, Groom& groom) {
  const auto group_count = static_cast<std::uint16_t>(groom.group_names.size());
  for (std::uint16_t group = 0; group < group_count; ++group) {
    RootLengths lengths;
    const double of_material = static_cast<double>(groom.materials.of(group).root_length_m);
    lengths.root_length_m = static_cast<float>(options.root_length_m.value_or(of_material));
    lengths.spread = static_cast<float>(options.root_spread);
    set_root_lengths(lengths, group, groom);
  }
}

}  // namespace

Result<void> import_groom(const ImportOptions& options) {
  if (const Result<void> possible = check_can_write({options.out}); !possible) return possible;
  HairFiles files = options.files;
  if (files.name.empty()) files.name = std::filesystem::path(options.out).stem().string();
  Result<Groom> imported = import_hair(files, options.import);
  if (!imported) return Refusal(imported.error());
  Groom& groom = *imported;
  if (const Result<void> applied = apply_materials(options.materials, groom); !applied) return applied;
  if (options.root_length_m) {
    for (StrandProperties& strand : groom.strands) strand.root_length_m = static_cast<float>(*options.root_length_m);
  }
  if (options.root_spread > 0) spread_root_lengths(options, groom);
  return save_groom(groom, options.out);
}

}  // namespace hairnet::groom
