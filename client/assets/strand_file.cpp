#include "client/assets/strand_file.hpp"

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

std::optional<StrandFormat> strand_format_of(std::string_view path) {
  const std::string extension = extension_of(path);
  if (extension == ".hair") return StrandFormat::yuksel_hair;
  if (extension == ".tfx" || extension == ".txt") return StrandFormat::tressfx;
  if (extension == ".data") return StrandFormat::usc_data;
  if (extension == ".abc") return StrandFormat::alembic;
  if (extension == ".usda" || extension == ".usd" || extension == ".usdc" || extension == ".usdz")
    return StrandFormat::usd;
  if (extension == ".ply") return StrandFormat::ply;
  if (extension == ".npy" || extension == ".npz") return StrandFormat::npy;
  return {};
}

Result<ImportedStrands> read_strands(const std::string& path) {
  const std::optional<StrandFormat> format = strand_format_of(path);
  if (!format) return of_file(path, "strands are read from " + std::string(kHairFiles) + " files");
  const auto bytes = read_file(path);
  if (!bytes) return of_file(path, bytes.error());
  auto strands = decode_strands(*format, *bytes);
  if (!strands) return of_file(path, strands.error());
  return strands;
}

bool is_body_file(std::string_view path) {
  const std::string extension = extension_of(path);
  return extension == ".glb" || extension == ".gltf" || extension == ".vrm";
}

Result<ImportedBody> read_body(const std::string& path) {
  const std::string extension = extension_of(path);
  if (!is_listed(extension, kBodyFiles))
    return of_file(path, "bodies are read from " + std::string(kBodyFiles) + " files");
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
