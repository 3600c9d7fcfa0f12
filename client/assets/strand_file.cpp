#include "client/assets/strand_file.hpp"

#include <algorithm>
#include <filesystem>
#include <utility>

#include "client/assets/import/obj.hpp"
#include "client/files/read_file.hpp"

namespace hairnet {
namespace {

Refusal of_file(const std::string& path, const std::string& reason) {
  return Refusal(path + ": " + reason);
}

// Whether the extension is one of a list such as ".obj .ply".
bool is_listed(const std::string& extension, std::string_view list) {
  return !extension.empty() && (' ' + std::string(list) + ' ').find(' ' + extension + ' ') != std::string::npos;
}

}  // namespace

std::string strand_extensions() {
  std::string text;
  for (const StrandReader& reader : strand_readers()) (text += text.empty() ? "" : " ") += reader.extension;
  return text;
}

StrandDecoder* strand_decoder_of(std::string_view path) {
  const auto found = std::ranges::find(strand_readers(), extension_of(path), &StrandReader::extension);
  return found == strand_readers().end() ? nullptr : found->decode;
}

Result<ImportedStrands> read_strands(const std::string& path) {
  StrandDecoder* const decode = strand_decoder_of(path);
  if (decode == nullptr) return of_file(path, "strands are read from " + strand_extensions() + " files");
  const auto bytes = read_file(path);
  if (!bytes) return of_file(path, bytes.error());
  auto strands = decode(*bytes);
  if (!strands) return of_file(path, strands.error());
  return strands;
}

bool is_body_file(std::string_view path) {
  const std::string extension = extension_of(path);
  return extension == ".glb" || extension == ".gltf" || extension == ".vrm";
}

bool may_hold_body(std::string_view path) {
  return is_listed(extension_of(path), kBodyFiles);
}

Result<ImportedBody> read_body(const std::string& path) {
  const std::string extension = extension_of(path);
  if (!may_hold_body(path)) return of_file(path, "bodies are read from " + std::string(kBodyFiles) + " files");
  const auto bytes = read_file(path);
  if (!bytes) return of_file(path, bytes.error());
  Result<ImportedBody> body;
  const auto take_mesh = [&](Result<TriangleMesh> mesh) {
    if (!mesh) body = Refusal(mesh.error());
    if (mesh) body->mesh = std::move(*mesh);
  };
  if (is_body_file(path)) {
    const std::filesystem::path folder = std::filesystem::path(path).parent_path();
    body = decode_gltf_body(*bytes, [&](const std::string& name) { return read_file((folder / name).string()); });
  } else if (extension == ".obj") {
    take_mesh(decode_obj(as_text(*bytes)));
  } else if (extension == ".ply") {
    take_mesh(decode_ply_mesh(*bytes));
  } else {
    body = decode_usd_body(*bytes);
  }
  if (!body) return of_file(path, body.error());
  return body;
}

}  // namespace hairnet
