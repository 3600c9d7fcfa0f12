#include "client/tools/files/read_file.hpp"

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <memory>

namespace hairnet {
namespace {

struct CloseFile {
  void operator()(std::FILE* file) const { std::fclose(file); }
};

Refusal system_refusal(const char* what) {
  return Refusal(std::string(what) + ": " + std::strerror(errno));
}

}  // namespace

Result<std::vector<std::byte>> read_file(const std::string& path, std::size_t bytes_max) {
  std::error_code ignored;
  if (std::filesystem::is_directory(path, ignored)) return Refusal("is a directory, not a file");
  const std::unique_ptr<std::FILE, CloseFile> file(std::fopen(path.c_str(), "rb"));
  if (!file) return system_refusal("cannot be opened");

  // In growing pieces rather than by the size asked for first: a pipe has none, and a file may change meanwhile.
  std::vector<std::byte> bytes;
  std::size_t piece = std::size_t{1} << 16;
  while (true) {
    const std::size_t before = bytes.size();
    const std::size_t wanted = std::min(piece, bytes_max + 1 - before);
    bytes.resize(before + wanted);
    const std::size_t got = std::fread(bytes.data() + before, 1, wanted, file.get());
    bytes.resize(before + got);
    if (bytes.size() > bytes_max) return Refusal("is larger than the limit of " + std::to_string(bytes_max) + " bytes");
    if (got < wanted) break;
    piece = std::min(piece * 2, std::size_t{1} << 24);
  }
  if (std::ferror(file.get())) return system_refusal("cannot be read");
  if (bytes.empty()) return Refusal("is empty");
  return bytes;
}

}  // namespace hairnet
