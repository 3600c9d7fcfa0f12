#include "client/assets/body_file.hpp"

#include <filesystem>

#include "client/assets/import/head_files.hpp"
#include "client/files/read_file.hpp"

namespace hairnet {

Result<ImportedBody> read_body(const std::string& path) {
  const auto refused = [&](const std::string& reason) { return Refusal(path + ": " + reason); };
  if (!may_hold_body(path)) return refused("bodies are read from " + std::string(kBodyFiles) + " files");
  const auto bytes = read_file(path);
  if (!bytes) return refused(bytes.error());
  // Every other body is one file, and `decode_body` names it in its errors.
  if (!is_body_file(path)) return decode_body(path, *bytes);
  const std::filesystem::path folder = std::filesystem::path(path).parent_path();
  Result<ImportedBody> body =
      decode_gltf_body(*bytes, [&](const std::string& name) { return read_file((folder / name).string()); });
  if (!body) return refused(body.error());
  return body;
}

}  // namespace hairnet
