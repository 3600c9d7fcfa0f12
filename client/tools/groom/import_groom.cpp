#include <cstdio>
#include <filesystem>

#include "client/tools/files/read_file.hpp"
#include "client/tools/files/write_file.hpp"
#include "client/tools/groom/commands.hpp"
#include "client/tools/groom/save_groom.hpp"
#include "core/build/far_strips.hpp"
#include "core/groom/root_lengths.hpp"
#include "core/import/obj.hpp"
#include "core/import/strands.hpp"

namespace hairnet::groom {
namespace {

Refusal of_file(const std::string& file, const std::string& reason) {
  return Refusal(file + ": " + reason);
}

Result<StrandFormat> format_of(const std::string& file) {
  const std::string extension = std::filesystem::path(file).extension().string();
  if (extension == ".hair") return StrandFormat::yuksel_hair;
  if (extension == ".tfx") return StrandFormat::tressfx;
  if (extension == ".data") return StrandFormat::usc_data;
  return of_file(file, "strands are read from .hair, .tfx and .data files");
}

Result<ImportedStrands> read_strands(const std::string& file) {
  const Result<StrandFormat> format = format_of(file);
  if (!format) return Refusal(format.error());
  const auto bytes = read_file(file);
  if (!bytes) return of_file(file, bytes.error());
  auto strands = decode_strands(*format, *bytes);
  if (!strands) return of_file(file, strands.error());
  return strands;
}

Result<TriangleMesh> read_mesh(const std::string& file) {
  const auto bytes = read_file(file);
  if (!bytes) return of_file(file, bytes.error());
  auto mesh = decode_obj(as_text(*bytes));
  if (!mesh) return of_file(file, mesh.error());
  return mesh;
}

void spread_root_lengths(const ImportOptions& options, Groom& groom) {
  for (std::uint16_t group = 0; group < groom.group_names.size(); ++group) {
    RootLengths lengths;
    const double of_material = static_cast<double>(groom.materials.of(group).root_length_m);
    lengths.root_length_m = static_cast<float>(options.root_length_m.value_or(of_material));
    lengths.spread = static_cast<float>(options.root_spread);
    set_root_lengths(lengths, group, groom);
  }
}

}  // namespace

Result<void> import_groom(const ImportOptions& options) {
  GroomDef def;
  for (std::size_t i = 0; i < options.files.size(); ++i) {
    auto strands = read_strands(options.files[i]);
    if (!strands) return Refusal(strands.error());
    const std::string stem = std::filesystem::path(options.files[i]).stem().string();
    def.files.push_back({std::move(*strands), options.groups.empty() ? stem : options.groups[i]});
  }
  if (!options.body.empty()) {
    auto mesh = read_mesh(options.body);
    if (!mesh) return Refusal(mesh.error());
    def.body = std::move(*mesh);
  }
  def.name = options.name.empty() ? std::filesystem::path(options.out).stem().string() : options.name;
  def.placement = options.placement;
  if (options.body_up || options.body_face || options.body_unit_m) {
    def.body_placement = Placement{options.body_up.value_or(options.placement.up),
                                   options.body_face.value_or(options.placement.face),
                                   options.body_unit_m.value_or(options.placement.unit_m),
                                   {}};
  }
  def.hairs_in_all = options.hairs_in_all;
  auto imported = assemble_groom(def);
  if (!imported) return of_file(options.files.front(), imported.error());
  for (const std::string& warning : imported->warnings) std::fprintf(stderr, "note: %s\n", warning.c_str());
  Groom& groom = imported->groom;
  if (const Result<void> applied = apply_materials(options.materials, groom); !applied) return applied;
  if (options.root_length_m) {
    for (StrandProperties& strand : groom.strands) strand.root_length_m = static_cast<float>(*options.root_length_m);
  }
  if (options.root_spread > 0) spread_root_lengths(options, groom);
  groom.far_strips = make_far_strips(groom, options.strip_count.value_or(far_strip_count_for(groom)));
  return save_groom(groom, options.out);
}

}  // namespace hairnet::groom
