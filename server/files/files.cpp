#include "server/files/files.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <system_error>

#include "server/files/descriptor.hpp"

namespace hairnet::server {
namespace {

constexpr std::string_view kByteOrderMark = "\xef\xbb\xbf";

Refusal errno_refusal() {
  return Refusal(std::strerror(errno));
}

// Asks the open file and not its path, which may mean another file by now.
std::string kind_error(const Descriptor& file) {
  struct stat status {};
  if (::fstat(file.get(), &status) != 0) return std::strerror(errno);
  if (S_ISDIR(status.st_mode)) return "is a folder, not a file";
  return S_ISREG(status.st_mode) ? "" : "is a pipe or device, not a file";
}

// Moves the text into what it is on Unix.
void make_plain(std::string& text) {
  if (text.starts_with(kByteOrderMark)) text.erase(0, kByteOrderMark.size());
  std::size_t kept = 0;
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (text[i] != '\r' || i + 1 == text.size() || text[i + 1] != '\n') text[kept++] = text[i];
  }
  text.resize(kept);
}

}  // namespace

Result<std::string> read_text_file(const std::string& path, std::size_t bytes_max) {
  // O_NONBLOCK: opening a pipe without a writer would wait for one. O_NOCTTY: a terminal must not become the program's
  // own.
  const Descriptor file(::open(path.c_str(), O_RDONLY | O_NONBLOCK | O_CLOEXEC | O_NOCTTY));
  if (!file) return errno_refusal();
  if (std::string error = kind_error(file); !error.empty()) return Refusal(std::move(error));
  std::string text;
  // The size that the system tells is not trusted: a file may grow while it is read.
  for (std::array<char, 1 << 14> piece; true;) {
    const ssize_t got = ::read(file.get(), piece.data(), piece.size());
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) return errno_refusal();
    if (got == 0) break;
    text.append(piece.data(), static_cast<std::size_t>(got));
    if (text.size() > bytes_max) return Refusal(fmt::format("has more than {} bytes", bytes_max));
  }
  make_plain(text);
  return text;
}

std::string_view take_line(std::string_view& text) {
  const std::size_t end = std::min(text.find('\n'), text.size());
  const std::string_view line = text.substr(0, end);
  text.remove_prefix(std::min(end + 1, text.size()));
  return line;
}

std::string try_folder(const std::string& path, std::vector<std::string>& made) {
  namespace fs = std::filesystem;
  std::error_code error;
  std::vector<std::string> missing;
  // Goes up from the folder to the first one that exists, so that the caller can remove just the folders that were
  // made.
  for (fs::path part = fs::absolute(path, error).lexically_normal();
       !error && !part.empty() && !fs::exists(part, error); part = part.parent_path())
    missing.insert(missing.begin(), part.string());
  if (!fs::is_directory(path, error)) {
    if (fs::create_directories(path, error); error)
      return fmt::format("the folder {} cannot be made: {}", path, error.message());
    made.insert(made.end(), missing.begin(), missing.end());
    // Grooms and levels belong to the operator; other users of the machine have no business there.
    fs::permissions(path, fs::perms::owner_all, error);
  }
  std::string name = path + "/.hairnet-XXXXXX";
  // Only a write shows that one is possible: rights, quotas and read-only file systems all count.
  const Descriptor file(::mkostemp(name.data(), O_CLOEXEC));
  const bool is_written = file && ::write(file.get(), "\n", 1) == 1;
  const int errno_of_write = is_written ? 0 : errno;
  if (file) ::unlink(name.c_str());
  if (errno_of_write == 0 || errno_of_write == ENOSPC || errno_of_write == EDQUOT) return {};
  return fmt::format("the folder {} cannot be written: {}", path, std::strerror(errno_of_write));
}

std::string try_file(const std::string& path) {
  // The file is opened as the server will open it, without cutting it. A file that this has made is removed again.
  const bool existed = ::access(path.c_str(), F_OK) == 0;
  const Descriptor file(::open(path.c_str(), O_WRONLY | O_CREAT | O_NONBLOCK | O_CLOEXEC | O_NOCTTY, 0666));
  // A pipe without a reader.
  if (!file && errno == ENXIO) return "is a pipe or device, not a file";
  if (!file) return std::strerror(errno);
  if (std::string error = kind_error(file); !error.empty()) return error;
  if (!existed) ::unlink(path.c_str());
  return {};
}

}  // namespace hairnet::server
