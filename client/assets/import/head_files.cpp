#include "client/assets/import/head_files.hpp"

#include <algorithm>
#include <utility>

#include "client/assets/import/obj.hpp"
#include "client/assets/import/parse_text.hpp"
#include "core/file_name.hpp"

namespace hairnet {
namespace {

Refusal of_file(const std::string& file, const std::string& reason) {
  return Refusal(file + ": " + reason);
}

// Whether the extension is one of a list such as ".obj .ply". Blanks on both sides keep .usd from being found in .usda.
bool is_listed(const std::string& extension, std::string_view list) {
  return !extension.empty() && (' ' + std::string(list) + ' ').find(' ' + extension + ' ') != std::string::npos;
}

Result<ImportedBody> body_of(Result<TriangleMesh> mesh) {
  if (!mesh) return Refusal(mesh.error());
  ImportedBody body;
  body.mesh = std::move(*mesh);
  return body;
}

// A group that the caller names replaces all groups of the file.
void add_strands(ImportedStrands strands, const std::string& file, const std::string& group, HairParts& parts) {
  if (!group.empty()) {
    strands.groups.assign(strands.strand_count(), 0);
    strands.group_names = {group};
  }
  for (StrandGroup& part : divide_groups(std::move(strands)))
    parts.strands.push_back({std::move(part.strands), part.name.empty() ? std::string(stem_of(file)) : part.name, file,
                             std::move(part.widths)});
}

}  // namespace

std::string strand_extensions() {
  std::string text;
  for (const StrandReader& reader : strand_readers()) (text += text.empty() ? "" : " ") += reader.extension;
  return text;
}

StrandDecoder* strand_decoder_of(std::string_view file) {
  // An extension is compared in small letters.
  const auto found = std::ranges::find(strand_readers(), extension_of(file), &StrandReader::extension);
  return found == strand_readers().end() ? nullptr : found->decode;
}

bool is_body_file(std::string_view file) {
  return is_listed(extension_of(file), ".glb .gltf .vrm");
}

bool may_hold_body(std::string_view file) {
  return is_listed(extension_of(file), kBodyFiles);
}

Result<ImportedBody> decode_body(const std::string& file, std::span<const std::byte> bytes) {
  const std::string extension = extension_of(file);
  Result<ImportedBody> body = extension == ".obj"   ? body_of(decode_obj(as_text(bytes)))
                              : extension == ".ply" ? body_of(decode_ply_mesh(bytes))
                                                    : decode_usd_body(bytes);
  if (!body) return of_file(file, body.error());
  return body;
}

Result<void> add_body(const std::string& file, Result<ImportedBody> body, HairParts& parts) {
  if (!body) return Refusal(body.error());
  if (parts.body) return of_file(file, "a second body beside " + parts.body_file);
  parts.body = std::move(*body);
  parts.body_file = file;
  return {};
}

Result<void> add_file(const std::string& file, std::span<const std::byte> bytes, const std::string& group,
                      HairParts& parts) {
  StrandDecoder* const decode = strand_decoder_of(file);
  if (decode == nullptr) return of_file(file, "strands are read from " + strand_extensions() + " files");
  Result<ImportedStrands> strands = decode(bytes);
  // Some formats hold strands or a body: what has no strand may have a mesh. The error of the strands is told if the
  // mesh fails as well, since the file was taken for hair.
  if ((!strands || strands->strand_count() == 0) && may_hold_body(file)) {
    Result<ImportedBody> body = decode_body(file, bytes);
    if (body || strands) return add_body(file, std::move(body), parts);
  }
  if (!strands) return of_file(file, strands.error());
  add_strands(std::move(*strands), file, group, parts);
  return {};
}

}  // namespace hairnet
