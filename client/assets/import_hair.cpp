#include "client/assets/import_hair.hpp"

#include <glob.h>

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <utility>

#include "client/assets/body_file.hpp"
#include "client/assets/fitted_hair.hpp"
#include "client/assets/import/guess_placement.hpp"
#include "client/assets/import/head_files.hpp"
#include "client/files/read_file.hpp"
#include "core/file_name.hpp"

namespace hairnet {
namespace {

// glTF bodies may need files beside them, so they are read here by name; all other formats are decoded from their bytes
// alone.
Result<void> read_part(const std::string& file, const std::string& group, HairParts& parts) {
  if (is_body_file(file)) return add_body(file, read_body(file), parts);
  const auto bytes = read_file(file);
  if (!bytes) return Refusal(file + ": " + bytes.error());
  return add_file(file, *bytes, group, parts);
}

// There is no hair to align with, so the body alone must show a head. The flags of this path are those of
// `hairnet-groom` in any program, because only the body's are concerned.
Result<ImportedGroom> groom_of_body(const HairParts& parts, const HairImport& import) {
  std::vector<std::string> notes, doubts;
  const KnownPlacement known = known_of_body(parts, import.body, notes, doubts);
  const Result<Placement> placement = guess_mesh_placement(parts.body->mesh, known);
  if (!placement)
    return Refusal(parts.body_file + ": no head is seen in it, since " + placement.error() +
                   "; hairnet-groom's --body-up, --body-face and --body-unit say how it lies");
  notes.insert(notes.end(), doubts.begin(), doubts.end());
  notes.push_back(parts.body_file + ": taken for a head, " + to_string(*placement) + "; with made hair");
  TriangleMesh mesh;
  mesh.triangles = parts.body->mesh.triangles;
  // The mesh goes to head space: its head joint becomes the origin, which `fitted_hair` expects.
  for (const Vec3f& v : parts.body->mesh.vertices) mesh.vertices.push_back(place(*placement, *placement->origin, v));
  Result<Groom> groom = fitted_hair(mesh);
  if (!groom)
    return Refusal(parts.body_file + ": " + groom.error() +
                   ", and made hair fits no other: give a strand file with it");
  return ImportedGroom{std::move(*groom), *placement, std::move(notes)};
}

std::vector<std::string> files_in(const std::filesystem::path& folder) {
  std::vector<std::string> files;
  std::error_code error;
  for (const auto& entry : std::filesystem::directory_iterator(folder, error)) {
    const std::string file = entry.path().string();
    // A .txt may be anything, so a folder's are not taken for TressFX 2. A file that the user names is.
    if (is_foreign_file(file) && extension_of(file) != ".txt") files.push_back(file);
  }
  // Folders list their files in no order; sorting gives the same groups on every machine.
  std::ranges::sort(files);
  return files;
}

// The system's pattern rules apply. Its list is sorted, and empty where nothing matches.
std::vector<std::string> files_like(const std::string& pattern) {
  std::vector<std::string> files;
  glob_t found{};
  if (glob(pattern.c_str(), 0, nullptr, &found) == 0) files.assign(found.gl_pathv, found.gl_pathv + found.gl_pathc);
  globfree(&found);
  return files;
}

}  // namespace

bool is_foreign_file(std::string_view path) {
  return strand_decoder_of(path) != nullptr || is_body_file(path);
}

Result<ImportedGroom> import_hair(const HairFiles& files, const HairImport& import) {
  HairParts parts;
  for (std::size_t i = 0; i < files.files.size(); ++i) {
    const std::string& file = files.files[i];
    const Result<void> read = read_part(file, files.groups.empty() ? std::string() : files.groups.at(i), parts);
    if (!read) return Refusal(read.error());
  }
  // The body that a flag names comes last. Where the files have one already, the error names the flag's.
  if (!files.body.empty()) {
    if (const Result<void> read = add_body(files.body, read_body(files.body), parts); !read)
      return Refusal(read.error());
  }
  if (parts.strands.empty() && !parts.body) return Refusal("there are no files of hair");
  if (parts.strands.empty()) return groom_of_body(parts, import);
  parts.name = files.name.empty() ? parts.strands.front().group : files.name;
  return import_hair_parts(std::move(parts), import);
}

Result<Groom> load_hair(const HairFiles& files, const HairImport& import) {
  Result<ImportedGroom> imported = import_hair(files, import);
  if (!imported) return Refusal(imported.error());
  for (const std::string& line : imported->warnings) std::fprintf(stderr, "%s\n", line.c_str());
  return std::move(imported->groom);
}

Result<std::vector<std::string>> hair_files_of(std::span<const std::string> names) {
  std::vector<std::string> files;
  for (const std::string& name : names) {
    std::error_code error;
    std::vector<std::string> more{name};
    if (std::filesystem::is_directory(name, error)) {
      more = files_in(name);
      if (more.empty()) return Refusal(name + ": a folder without files of " + strand_extensions());
    } else if (name.find_first_of("*?") != std::string::npos && !std::filesystem::exists(name, error)) {
      // A name that exists is never a pattern, so stars in names of files do no harm.
      more = files_like(name);
      if (more.empty()) return Refusal(name + ": no file has such a name");
    }
    files.insert(files.end(), more.begin(), more.end());
  }
  return files;
}

}  // namespace hairnet
