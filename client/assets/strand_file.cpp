#include "client/assets/strand_file.hpp"

#include "client/assets/import/obj.hpp"
#include "client/files/read_file.hpp"

namespace hairnet {
namespace {

Refusal of_file(const std::string& path, const std::string& reason) {
  return Refusal(path + ": " + reason);
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

Result<TriangleMesh> read_mesh(const std::string& path) {
  const auto bytes = read_file(path);
  if (!bytes) return of_file(path, bytes.error());
  auto mesh = decode_obj(as_text(*bytes));
  if (!mesh) return of_file(path, mesh.error());
  return mesh;
}

}  // namespace hairnet
