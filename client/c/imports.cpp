#include <cmath>
#include <cstddef>
#include <span>

#include "client/assets/import/head_files.hpp"
#include "client/c/handles.hpp"
#include "core/file_name.hpp"
#include "core/shown_text.hpp"

// Grooms from the files of other programs. hairnet.h says what each function promises.
namespace hairnet::c {
namespace {

// All files are in memory at once, so their number, the bytes of a name, and the MiB in all are bounded.
constexpr std::size_t kImportFilesMax = 64, kImportNameBytesMax = 255, kImportMiBMax = 512;

Result<std::optional<Axis>> axis_of(const char* option, const char* text) {
  if (text == nullptr) return std::optional<Axis>();
  const Result<Axis> axis = parse_axis(text);
  if (!axis) return Refusal("options: " + std::string(option) + ": " + axis.error());
  return std::optional<Axis>(*axis);
}

// The caller's options as those of the import. The error names the option.
Result<HairImport> import_of(const hairnet_import_options& options) {
  HairImport import;
  const Result<std::optional<Axis>> up = axis_of("up", options.up), face = axis_of("face", options.face);
  if (!up) return Refusal(up.error());
  if (!face) return Refusal(face.error());
  // Two directions along one axis leave the third one open.
  if (*up && *face && parallel(**up, **face)) return Refusal("options: up and face lie along the same axis");
  import.strands.up = *up;
  import.strands.face = *face;
  if (!std::isfinite(options.unit_m) || options.unit_m < 0)
    return Refusal("options: unit_m is not a number of metres above 0, nor 0");
  if (options.unit_m > 0) import.strands.unit_m = options.unit_m;
  if (options.roots != nullptr) {
    const Result<RootEnd> roots = parse_root_end(options.roots);
    if (!roots) return Refusal("options: roots " + roots.error());
    import.roots = *roots;
  }
  return import;
}

// The files' names as messages show them.
Result<std::vector<std::string>> names_of(std::span<const hairnet_file> files) {
  if (files.empty() || files.size() > kImportFilesMax)
    return Refusal(std::to_string(files.size()) + " files; there may be 1 to " + std::to_string(kImportFilesMax));
  std::vector<std::string> names;
  std::size_t byte_count = 0;
  for (const hairnet_file& file : files) {
    const std::string_view name = file.name == nullptr ? std::string_view() : std::string_view(file.name);
    const std::string which = "file " + std::to_string(names.size());
    // The name's extension is what says the format; nothing is opened by this name.
    if (name.empty()) return Refusal(which + " has no name, whose extension would tell its format");
    if (name.size() > kImportNameBytesMax)
      return Refusal(which + " has a name of " + std::to_string(name.size()) + " bytes; it may have " +
                     std::to_string(kImportNameBytesMax));
    // The sum is compared by a subtraction, since it could wrap where size_t has 32 bits, as in WebAssembly.
    if (file.byte_count > (kImportMiBMax << 20) - byte_count)
      return Refusal("the files have more than " + std::to_string(kImportMiBMax) + " MiB in all");
    byte_count += file.byte_count;
    // Messages show the names, so control characters in them are escaped.
    names.push_back(shown_text(name, name.size(), '\0'));
  }
  return names;
}

Result<HairParts> parts_of(std::span<const hairnet_file> files, std::span<const std::string> names) {
  HairParts parts;
  for (std::size_t f = 0; f < files.size(); ++f) {
    const std::span bytes(static_cast<const std::byte*>(files[f].bytes), files[f].byte_count);
    if (bytes.empty()) return Refusal(names[f] + ": is empty");
    if (const Result<void> added = add_file(names[f], bytes, {}, parts); !added) return Refusal(added.error());
  }
  if (parts.strands.empty()) return Refusal(parts.body_file + ": holds a body and no strands of hair");
  parts.name = stem_of(parts.strands.front().file);
  return parts;
}

}  // namespace
}  // namespace hairnet::c

using namespace hairnet;

hairnet_error hairnet_groom_import(const hairnet_file* files, size_t file_count, const hairnet_import_options* options,
                                   hairnet_groom** groom, char* error, size_t error_size) {
  return c::guarded(
      [&] {
        const auto invalid = [&](const std::string& reason) {
          return c::refuse(HAIRNET_INVALID, reason, error, error_size);
        };
        const std::span all(files, file_count);
        const Result<std::vector<std::string>> names = c::names_of(all);
        if (!names) return invalid(names.error());
        const Result<hairnet_import_options> full =
            c::full_options<hairnet_import_options>(options, HAIRNET_IMPORT_OPTIONS, "HAIRNET_IMPORT_OPTIONS");
        if (!full) return invalid(full.error());
        const Result<HairImport> import = c::import_of(*full);
        if (!import) return invalid(import.error());
        Result<HairParts> parts = c::parts_of(all, *names);
        // MALFORMED is said of the bytes of a file, INVALID of options and of what the files mean together.
        if (!parts) return c::refuse(HAIRNET_MALFORMED, parts.error(), error, error_size);
        if (full->name != nullptr) parts->name = full->name;
        Result<ImportedGroom> imported = import_hair_parts(std::move(*parts), *import);
        if (!imported) return invalid(imported.error());
        const hairnet_error code = c::keep(std::move(imported->groom), HAIRNET_INVALID, groom, error, error_size);
        if (code != HAIRNET_OK) return code;
        for (const std::string& line : imported->warnings) (*groom)->remarks.append(line).append("\n");
        return code;
      },
      error, error_size);
}

const char* hairnet_groom_remarks(const hairnet_groom* groom) {
  return groom->remarks.c_str();
}
