#include "client/assets/import_hair.hpp"

#include <cstdio>
#include <filesystem>
#include <utility>

#include "client/assets/fitted_hair.hpp"
#include "client/assets/import/guess_placement.hpp"
#include "client/assets/import/obj.hpp"
#include "client/assets/print_warnings.hpp"
#include "client/assets/strand_file.hpp"
#include "client/files/read_file.hpp"

namespace hairnet {
namespace {

Result<void> take_body(const std::string& file, Result<ImportedBody> body, HairParts& parts) {
  if (!body) return Refusal(body.error());
  if (parts.body) return Refusal(file + ": a second body beside " + parts.body_file);
  parts.body = std::move(*body);
  parts.body_file = file;
  return {};
}

// The group of a file's strands: as it is given, else those that the file names, else its stem.
void add_strands(ImportedStrands strands, const std::string& file, const std::string& group, HairParts& parts) {
  if (!group.empty()) {
    strands.groups.assign(strands.strand_count(), 0);
    strands.group_names = {group};
  }
  const std::string stem = std::filesystem::path(file).stem().string();
  for (StrandGroup& part : divide_groups(std::move(strands)))
    parts.strands.push_back({std::move(part.strands), part.name.empty() ? stem : part.name, file});
}

Result<void> read_part(const std::string& file, const std::string& group, HairParts& parts) {
  if (is_body_file(file)) return take_body(file, read_body(file), parts);
  if (const auto format = strand_format_of(file)) {
    auto strands = read_strands(file);
    // Such a file without strands may have a mesh.
    if (!strands && (format == StrandFormat::ply || format == StrandFormat::usd)) {
      if (Result<ImportedBody> body = read_body(file)) return take_body(file, std::move(body), parts);
    }
    if (!strands) return Refusal(strands.error());
    add_strands(std::move(*strands), file, group, parts);
    return {};
  }
  const auto bytes = read_file(file);
  if (!bytes) return Refusal(file + ": " + bytes.error());
  if (extension_of(file) != ".obj")
    return Refusal(file + ": strands are read from " + std::string(kHairFiles) + " files");
  auto lines = decode_obj_strands(as_text(*bytes));
  if (!lines) return Refusal(file + ": " + lines.error());
  if (lines->strand_count() == 0) return take_body(file, read_body(file), parts);
  add_strands(std::move(*lines), file, group, parts);
  return {};
}

Result<Groom> groom_of_body(const HairParts& parts, const HairImport& import) {
  std::vector<std::string> notes, doubts;
  const KnownPlacement known = known_of_body(parts, import.body, notes, doubts);
  const Result<Placement> placement = guess_mesh_placement(parts.body->mesh, known);
  if (!placement)
    return Refusal(parts.body_file + ": no head is seen in it, since " + placement.error() +
                   "; hairnet-groom's --body-up, --body-face and --body-unit say how it lies");
  for (const std::vector<std::string>* lines : {&notes, &doubts}) {
    for (const std::string& line : *lines) std::fprintf(stderr, "%s\n", line.c_str());
  }
  print_warnings(parts.body_file, std::vector{"taken for a head, " + to_string(*placement) + "; with made hair"});
  TriangleMesh mesh;
  mesh.triangles = parts.body->mesh.triangles;
  for (const Vec3f& v : parts.body->mesh.vertices) mesh.vertices.push_back(place(*placement, *placement->origin, v));
  Result<Groom> groom = fitted_hair(mesh);
  if (!groom)
    return Refusal(parts.body_file + ": " + groom.error() +
                   ", and made hair fits no other: give a strand file with it");
  return groom;
}

}  // namespace

bool is_foreign_hair(std::string_view path) {
  return strand_format_of(path).has_value() || is_body_file(path) || extension_of(path) == ".obj";
}

Result<Groom> import_hair(const HairFiles& files, const HairImport& import) {
  HairParts parts;
  for (std::size_t i = 0; i < files.files.size(); ++i) {
    const std::string& file = files.files[i];
    const Result<void> read = read_part(file, files.groups.empty() ? std::string() : files.groups.at(i), parts);
    if (!read) return Refusal(read.error());
  }
  if (!files.body.empty()) {
    if (const Result<void> read = take_body(files.body, read_body(files.body), parts); !read)
      return Refusal(read.error());
  }
  if (parts.strands.empty() && !parts.body) return Refusal("there are no files of hair");
  if (parts.strands.empty()) return groom_of_body(parts, import);
  parts.name = files.name.empty() ? parts.strands.front().group : files.name;
  Result<ImportedGroom> imported = import_hair_parts(std::move(parts), import);
  if (!imported) return Refusal(imported.error());
  for (const std::string& line : imported->warnings) std::fprintf(stderr, "%s\n", line.c_str());
  return std::move(imported->groom);
}

}  // namespace hairnet
