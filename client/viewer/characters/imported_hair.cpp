#include "client/viewer/characters/imported_hair.hpp"

#include <filesystem>
#include <optional>
#include <utility>

#include "client/assets/fitted_hair.hpp"
#include "client/assets/import/guess_placement.hpp"
#include "client/assets/import/obj.hpp"
#include "client/assets/load_groom.hpp"
#include "client/assets/load_motion.hpp"
#include "client/assets/print_warnings.hpp"
#include "client/assets/strand_file.hpp"
#include "client/files/read_file.hpp"
#include "core/hair_cards/far_cards.hpp"

namespace hairnet::viewer {
namespace {

// The strands and the body from the files, before they are placed.
struct Parts {
  std::vector<StrandFile> strands;
  std::optional<TriangleMesh> body;
  std::string strands_file, body_file;  // the first of each

  void add(const std::string& file, const std::string& group, ImportedStrands of) {
    if (strands.empty()) strands_file = file;
    strands.push_back({std::move(of), group});
  }
};

Result<void> read_part(const std::string& file, Parts& parts) {
  const std::string stem = std::filesystem::path(file).stem().string();
  if (strand_format_of(file)) {
    auto strands = read_strands(file);
    if (!strands) return Refusal(strands.error());
    parts.add(file, stem, std::move(*strands));
    return {};
  }
  const auto bytes = read_file(file);
  if (!bytes) return Refusal(file + ": " + bytes.error());
  auto lines = decode_obj_strands(as_text(*bytes));
  if (!lines) return Refusal(file + ": " + lines.error());
  if (lines->strand_count() > 0) {
    parts.add(file, stem, std::move(*lines));
    return {};
  }
  auto mesh = decode_obj(as_text(*bytes));
  if (!mesh) return Refusal(file + ": " + mesh.error());
  if (parts.body) return Refusal(file + ": a second body beside " + parts.body_file);
  parts.body = std::move(*mesh);
  parts.body_file = file;
  return {};
}

void note(const std::string& file, const std::string& line) {
  print_warnings(file, std::span(&line, 1));
}

Result<Groom> groom_of_body(const Parts& parts) {
  const Result<Placement> placement = guess_mesh_placement(*parts.body);
  if (!placement) return Refusal(parts.body_file + ": " + placement.error());
  note(parts.body_file, "taken for a head, " + to_string(*placement) + "; with made hair");
  TriangleMesh mesh;
  mesh.triangles = parts.body->triangles;
  for (const Vec3f& v : parts.body->vertices) mesh.vertices.push_back(place(*placement, *placement->origin, v));
  Result<Groom> groom = fitted_hair(mesh);
  if (!groom) return Refusal(parts.body_file + ": " + groom.error());
  return groom;
}

Result<Groom> groom_of_strands(Parts parts) {
  const std::string& file = parts.strands_file;
  GroomDef def;
  def.name = parts.strands.front().group;
  const std::optional<PlacedTogether> together = parts.body ? guess_together(parts.strands, *parts.body) : std::nullopt;
  if (together) {
    def.placement = together->strands;
    def.body_placement = together->body;
    def.body = std::move(*parts.body);
    note(parts.body_file, "taken as " + to_string(together->body));
  } else {
    const Result<Placement> alone = guess_placement(parts.strands);
    if (!alone) return Refusal(file + ": " + alone.error());
    def.placement = *alone;
    if (parts.body)
      note(parts.body_file, "does not fit under the hair in any usual axes and unit; a skull is made instead");
  }
  note(file, "taken as " + to_string(def.placement));
  def.files = std::move(parts.strands);
  Result<ImportedGroom> imported = assemble_groom(def);
  if (!imported) return Refusal(file + ": " + imported.error());
  print_warnings(file, imported->warnings);
  return std::move(imported->groom);
}

}  // namespace

bool is_foreign_hair(std::string_view path) {
  return strand_format_of(path).has_value() || extension_of(path) == ".obj";
}

Result<Groom> import_hair(std::span<const std::string> files) {
  Parts parts;
  for (const std::string& file : files) {
    if (const Result<void> read = read_part(file, parts); !read) return Refusal(read.error());
  }
  Result<Groom> groom = parts.strands.empty() ? groom_of_body(parts) : groom_of_strands(std::move(parts));
  if (groom) groom->far_cards = make_far_cards(*groom, far_card_count_for(*groom));
  return groom;
}

Result<std::vector<CharacterSetup>> characters_of_files(std::span<const std::string> files) {
  std::vector<std::string> foreign, motions;
  std::vector<std::shared_ptr<const Groom>> grooms;
  for (const std::string& file : files) {
    if (is_foreign_hair(file)) {
      foreign.push_back(file);
    } else if (extension_of(file) == ".bvh") {
      motions.push_back(file);
    } else if (extension_of(file) == ".groom") {
      Result<Groom> groom = load_groom(file);
      if (!groom) return Refusal(file + ": " + groom.error());
      grooms.push_back(std::make_shared<const Groom>(std::move(*groom)));
    } else {
      return Refusal(file + ": not one of .hair, .tfx, .data, .obj, .groom, .bvh");
    }
  }
  if (motions.size() > 1) return Refusal(motions[1] + ": a second motion beside " + motions[0]);
  if (!foreign.empty()) {
    Result<Groom> groom = import_hair(foreign);
    if (!groom) return Refusal(groom.error());
    grooms.push_back(std::make_shared<const Groom>(std::move(*groom)));
  }
  if (grooms.empty()) {
    Result<Groom> groom = load_groom("made:long_straight");
    if (!groom) return Refusal(groom.error());
    grooms.push_back(std::make_shared<const Groom>(std::move(*groom)));
  }
  std::vector<CharacterSetup> characters;
  for (const std::shared_ptr<const Groom>& groom : grooms) {
    const std::string spec = motions.empty() ? "made:look_around" : motions[0];
    Result<Motion> motion = load_motion(spec, {}, &groom->body);
    if (!motion) return Refusal(spec + ": " + motion.error());
    characters.push_back({groom, std::move(*motion), LevelIndex::high, Vec3f::Zero(), {}});
  }
  return characters;
}

}  // namespace hairnet::viewer
