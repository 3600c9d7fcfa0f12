#include <cstdio>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "client/files/write_file.hpp"
#include "client/tools/groom/commands.hpp"
#include "client/tools/groom/save_groom.hpp"
#include "core/groom/root_lengths.hpp"

namespace hairnet::groom {
namespace {

void spread_root_lengths(const ImportOptions& options, Groom& groom) {
  const auto group_count = static_cast<std::uint16_t>(groom.group_names.size());
  for (std::uint16_t group = 0; group < group_count; ++group) {
    // A group with its own material has its own root length to begin with.
    RootLengths lengths;
    const double of_material = static_cast<double>(groom.materials.of(group).root_length_m);
    lengths.root_length_m = static_cast<float>(options.root_length_m.value_or(of_material));
    lengths.spread = static_cast<float>(options.root_spread);
    set_root_lengths(lengths, group, groom);
  }
}

nlohmann::ordered_json json_of(const ImportedGroom& imported, const std::string& file) {
  const Groom& groom = imported.groom;
  const Placement& placement = imported.placement;
  std::vector<std::size_t> strands(groom.group_names.size());
  for (const StrandProperties& strand : groom.strands) ++strands[strand.group];
  nlohmann::ordered_json groups = nlohmann::ordered_json::array();
  for (std::size_t g = 0; g < strands.size(); ++g)
    groups.push_back({{"name", groom.group_names[g]}, {"strands", strands[g]}});
  return {{"file", file},
          {"name", groom.name},
          {"strands", groom.strand_count()},
          {"points", groom.points.size()},
          {"groups", groups},
          {"up", name_of(placement.up)},
          {"face", name_of(placement.face)},
          {"unit_m", placement.unit_m},
          {"remarks", imported.warnings}};
}

}  // namespace

Result<void> import_groom(const ImportOptions& options) {
  if (const Result<void> possible = check_can_write({options.out}); !possible) return possible;
  // Folders and patterns become files first, since group names are matched to those.
  HairFiles files = options.files;
  Result<std::vector<std::string>> all = hair_files_of(files.files);
  if (!all) return Refusal(all.error());
  files.files = std::move(*all);
  if (!files.groups.empty() && files.groups.size() != files.files.size())
    return Refusal("--group: " + std::to_string(files.groups.size()) + " names for " +
                   std::to_string(files.files.size()) + " files; give as many, or none");
  if (files.name.empty()) files.name = std::filesystem::path(options.out).stem().string();
  Result<ImportedGroom> imported = import_hair(files, options.import);
  if (!imported) return Refusal(imported.error());
  Groom& groom = imported->groom;
  // In JSON the warnings are a field; lines on stderr would say them twice.
  if (!options.json) {
    for (const std::string& line : imported->warnings) std::fprintf(stderr, "%s\n", line.c_str());
  }
  // The order matters: a material brings its root length, which the next two flags override and spread.
  if (const Result<void> applied = apply_materials(options.materials, groom); !applied) return applied;
  if (options.root_length_m) {
    for (StrandProperties& strand : groom.strands) strand.root_length_m = static_cast<float>(*options.root_length_m);
  }
  // The spread's base is the material's, or --root-length where it is given.
  if (options.root_spread > 0) spread_root_lengths(options, groom);
  if (!options.json) return save_groom(groom, options.out);
  if (const Result<void> written = write_groom(groom, options.out); !written) return written;
  std::printf("%s\n", json_of(*imported, options.out).dump(2).c_str());
  return {};
}

}  // namespace hairnet::groom
