#include <filesystem>

#include "client/assets/import/guess_placement.hpp"
#include "client/assets/print_warnings.hpp"
#include "client/assets/strand_file.hpp"
#include "client/files/write_file.hpp"
#include "client/tools/groom/commands.hpp"
#include "client/tools/groom/save_groom.hpp"
#include "core/groom/root_lengths.hpp"
#include "core/hair_cards/far_cards.hpp"

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

// Hair hangs down the back: the strands tell where the face is, unless they are of another head than a usual one.
Axis face_of(const ImportOptions& options, const GroomDef& def) {
  if (options.face) return *options.face;
  const Axis up = options.placement.up;
  if (!parallel(up, options.placement.face)) return options.placement.face;
  const Result<Placement> guessed = guess_placement(def.files);
  const Axis face = guessed && guessed->up == up ? guessed->face : Axis::plus_y;
  print_warnings(options.files.front(), std::vector{"the face is taken to look along " + std::string(name_of(face)) +
                                                    "; give --face if the hair sits back to front"});
  return face;
}

}  // namespace

Result<void> import_groom(const ImportOptions& options) {
  if (const Result<void> possible = check_can_write({options.out}); !possible) return possible;
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
  def.placement.face = face_of(options, def);
  if (options.body_up || options.body_face || options.body_unit_m) {
    def.body_placement = Placement{options.body_up.value_or(options.placement.up),
                                   options.body_face.value_or(def.placement.face),
                                   options.body_unit_m.value_or(options.placement.unit_m),
                                   {}};
  }
  def.hairs_in_all = options.hairs_in_all;
  auto imported = assemble_groom(def);
  if (!imported) return Refusal(options.files.front() + ": " + imported.error());
  print_warnings(options.files.front(), imported->warnings);
  Groom& groom = imported->groom;
  if (const Result<void> applied = apply_materials(options.materials, groom); !applied) return applied;
  if (options.root_length_m) {
    for (StrandProperties& strand : groom.strands) strand.root_length_m = static_cast<float>(*options.root_length_m);
  }
  if (options.root_spread > 0) spread_root_lengths(options, groom);
  groom.far_cards = make_far_cards(groom, options.card_count.value_or(far_card_count_for(groom)));
  return save_groom(groom, options.out);
}

}  // namespace hairnet::groom
