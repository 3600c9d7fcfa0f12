#include "client/files/write_file.hpp"

#include "schema/files/output_file.hpp"

namespace hairnet {

Result<void> check_can_write(std::initializer_list<std::string_view> paths) {
  for (const std::string_view path : paths) {
    if (path.empty()) continue;
    if (const std::string error = error_of_output(std::string(path)); !error.empty())
      return Refusal(std::string(path) + ": " + error);
  }
  return {};
}

Result<void> write_file(const std::string& path, std::span<const std::byte> bytes) {
  Result<OutputFile> file = OutputFile::create(path);
  if (!file) return Refusal(file.error());
  file->write(bytes);
  return file->finish();
}

}  // namespace hairnet
