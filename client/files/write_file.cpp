#include "client/files/write_file.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <filesystem>

#include "client/files/system_refusal.hpp"

namespace hairnet {
namespace {

bool write_all(int file, std::span<const std::byte> bytes) {
  while (!bytes.empty()) {
    const ssize_t written = ::write(file, bytes.data(), bytes.size());
    if (written < 0 && errno == EINTR) continue;
    if (written <= 0) return false;
    bytes = bytes.subspan(static_cast<std::size_t>(written));
  }
  return true;
}

Result<void> write_device(const std::string& path, std::span<const std::byte> bytes) {
  const int file = ::open(path.c_str(), O_WRONLY | O_CLOEXEC);
  if (file < 0) return system_refusal("cannot be opened for writing");
  const bool written = write_all(file, bytes);
  const int fault = errno;
  ::close(file);
  errno = fault;
  if (!written) return system_refusal("cannot be written");
  return {};
}

// mkstemp makes files that only their owner can read; the result gets the mode of any new file.
mode_t mode_of_new_files() {
  const mode_t mask = ::umask(0);
  ::umask(mask);
  return 0666 & ~mask;
}

// Empty, or why no file can be written there.
std::string fault_of(const std::filesystem::path& path) {
  std::error_code ignored;
  if (std::filesystem::is_directory(path, ignored)) return "is a folder, not a file: give a file's name in it";
  if (std::filesystem::exists(path, ignored) && !std::filesystem::is_regular_file(path, ignored)) return {};
  const std::filesystem::path folder = path.has_parent_path() ? path.parent_path() : ".";
  if (!std::filesystem::is_directory(folder, ignored))
    return "there is no folder " + folder.string() + ": make it first";
  if (::access(folder.c_str(), W_OK | X_OK) == 0) return {};
  return "cannot be written, its folder " + folder.string() + ": " + std::strerror(errno);
}

}  // namespace

Result<void> check_can_write(std::initializer_list<std::string_view> paths) {
  for (const std::string_view path : paths) {
    if (path.empty()) continue;
    if (const std::string fault = fault_of(path); !fault.empty()) return Refusal(std::string(path) + ": " + fault);
  }
  return {};
}

Result<void> write_file(const std::string& path, std::span<const std::byte> bytes) {
  std::error_code ignored;
  if (std::filesystem::is_directory(path, ignored)) return Refusal("is a directory, not a file");
  if (std::filesystem::exists(path, ignored) && !std::filesystem::is_regular_file(path, ignored))
    return write_device(path, bytes);

  // Follows a link to its target: renaming over the link would leave the target unchanged.
  const std::filesystem::path canonical = std::filesystem::weakly_canonical(path, ignored);
  const std::string target = canonical.empty() ? path : canonical.string();
  std::string temporary = target + ".XXXXXX";
  const int file = ::mkstemp(temporary.data());
  if (file < 0) return system_refusal("cannot be written there");
  bool written = write_all(file, bytes) && ::fchmod(file, mode_of_new_files()) == 0 && ::fsync(file) == 0;
  int fault = errno;
  if (::close(file) != 0 && written) {
    written = false;
    fault = errno;
  }
  if (written && ::rename(temporary.c_str(), target.c_str()) != 0) {
    written = false;
    fault = errno;
  }
  if (written) return {};
  ::unlink(temporary.c_str());
  errno = fault;
  return system_refusal("cannot be written");
}

}  // namespace hairnet
