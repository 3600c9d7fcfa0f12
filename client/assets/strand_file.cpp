#include "client/assets/strand_file.hpp"

#include <algorithm>

#include "client/assets/import/obj.hpp"
#include "client/files/read_file.hpp"

namespace hairnet {
namespace {

Refusal of_file(const std::string& path, const std::string& reason) {
  return Refusal(path + ": " + reason);
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

Result<TriangleMesh> read_mesh(const std::string& path) {
  const auto bytes = read_file(path);
  if (!bytes) return of_file(path, bytes.error());
  auto mesh = decode_obj(as_text(*bytes));
  if (!mesh) return of_file(path, mesh.error());
  return mesh;
}

}  // namespace hairnet
