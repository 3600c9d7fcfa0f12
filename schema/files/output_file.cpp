#include "schema/files/output_file.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <charconv>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <optional>
#include <utility>

#include "core/assert.hpp"
#include "schema/files/system_refusal.hpp"

namespace hairnet {
namespace {

namespace fs = std::filesystem;

// The most symbolic links that are followed, which is Linux's own limit.
constexpr int kLinksMax = 40;

// The open descriptor that a path stands for, such as /dev/stdout or a process substitution of the shell; none for
// other paths.
std::optional<int> descriptor_of(const std::string& path) {
  for (const std::string_view folder : {"/proc/self/fd/", "/dev/fd/"}) {
    if (!path.starts_with(folder)) continue;
    int number = -1;
    const char *begin = path.data() + folder.size(), *end = path.data() + path.size();
    if (const auto [at, error] = std::from_chars(begin, end, number); error == std::errc() && at == end && number >= 0)
      return number;
  }
  return std::nullopt;
}

// Where the bytes go: a path, or an open descriptor.
struct Place {
  // The path behind all symbolic links.
  std::string path;
  std::optional<int> descriptor;
};

// Follows the symbolic links of a path.
Place place_of(std::string path) {
  std::error_code error;
  for (int links = 0; links < kLinksMax; ++links) {
    // A descriptor's path is not followed further: its link names a file that a rename would replace, or a pipe, which
    // has no path.
    if (const std::optional<int> descriptor = descriptor_of(path)) return {std::move(path), descriptor};
    if (!fs::is_symlink(fs::symlink_status(path, error))) break;
    const fs::path to = fs::read_symlink(path, error);
    if (error) break;
    path = to.is_absolute() ? to.string() : (fs::path(path).parent_path() / to).string();
  }
  return {std::move(path), std::nullopt};
}

// Whether the place is no regular file, such as a device or a pipe, and so cannot be replaced.
bool is_special(const Place& place) {
  std::error_code ignored;
  return place.descriptor || (fs::exists(place.path, ignored) && !fs::is_regular_file(place.path, ignored));
}

// Gives a file of mkostemp, which only its owner can read, the owner and mode of the file that it replaces, or those
// that a new file would have.
bool give_permissions(int file, const std::string& target) {
  struct stat old {};
  if (::stat(target.c_str(), &old) != 0) {
    // The system tells the mask only to those who set it. A file that another thread makes between the two calls gets
    // no mask.
    const mode_t mask = ::umask(0);
    ::umask(mask);
    return ::fchmod(file, 0666 & ~mask) == 0;
  }
  // Only root can keep another user's file that user's. The owner comes first: a change of it takes bits of the mode
  // away.
  if (::fchown(file, old.st_uid, old.st_gid) != 0) errno = 0;
  return ::fchmod(file, old.st_mode & 07777) == 0;
}

}  // namespace

OutputFile::Temporary::~Temporary() {
  if (!path.empty()) ::unlink(path.c_str());
}

std::string error_of_output(const std::string& path) {
  std::error_code ignored;
  const Place place = place_of(path);
  if (!place.descriptor && fs::is_directory(place.path, ignored))
    return "is a folder, not a file: give a file's name in it";
  if (is_special(place)) return {};
  const fs::path parent = fs::path(place.path).parent_path(), folder = parent.empty() ? "." : parent;
  if (!fs::is_directory(folder, ignored)) return "there is no folder " + folder.string() + ": make it first";
  if (::access(folder.c_str(), W_OK | X_OK) == 0) return {};
  return "cannot be written, its folder " + folder.string() + ": " + std::strerror(errno);
}

Result<OutputFile> OutputFile::create(const std::string& path) {
  if (std::string error = error_of_output(path); !error.empty()) return Refusal(std::move(error));
  OutputFile made;
  const Place place = place_of(path);
  std::string temporary;
  if (is_special(place)) {
    const int file = place.descriptor ? ::fcntl(*place.descriptor, F_DUPFD_CLOEXEC, 0)
                                      : ::open(place.path.c_str(), O_WRONLY | O_CLOEXEC | O_NOCTTY);
    if (file < 0) return system_refusal("cannot be opened for writing");
    made.in_place_.reset(::fdopen(file, "wb"));
    if (!made.in_place_) {
      ::close(file);
      return system_refusal("cannot be opened for writing");
    }
    std::error_code none;
    temporary = (fs::temp_directory_path(none) / "hairnet.XXXXXX").string();
  } else {
    made.target_ = place.path;
    // The temporary file lies in the target's folder, because a rename works only within one file system.
    temporary = made.target_ + ".XXXXXX";
  }
  const int file = ::mkostemp(temporary.data(), O_CLOEXEC);
  if (file < 0) return system_refusal("cannot be written there");
  made.temporary_.path = std::move(temporary);
  made.file_.reset(::fdopen(file, "w+b"));
  if (!made.file_) {
    ::close(file);
    return system_refusal("cannot be written there");
  }
  return made;
}

void OutputFile::write(std::span<const std::byte> bytes) {
  HAIRNET_ASSERT(file_);
  if (std::fwrite(bytes.data(), 1, bytes.size(), file_.get()) != bytes.size() && error_ == 0) error_ = errno;
}

void OutputFile::go_to_begin() {
  HAIRNET_ASSERT(file_);
  if (std::fseek(file_.get(), 0, SEEK_SET) != 0 && error_ == 0) error_ = errno;
}

Result<void> OutputFile::finish() {
  HAIRNET_ASSERT(file_);
  if (std::fflush(file_.get()) != 0 && error_ == 0) error_ = errno;
  if (error_ != 0) {
    errno = error_;
    return system_refusal("cannot be written");
  }
  if (in_place_) return copy_to_place();
  const int file = ::fileno(file_.get());
  // The order matters: the bytes reach the disk before the name does, so a crash leaves the old file or the whole new
  // one. A failure at any step leaves the name alone, and ~Temporary removes the file.
  if (!give_permissions(file, target_) || ::fsync(file) != 0 || std::fclose(file_.release()) != 0 ||
      ::rename(temporary_.path.c_str(), target_.c_str()) != 0)
    return system_refusal("cannot be written");
  // The file has its name now; the destructor has nothing to remove.
  temporary_.path.clear();
  return {};
}

Result<void> OutputFile::copy_to_place() {
  // Another program may have put another file under the name.
  file_.reset(std::fopen(temporary_.path.c_str(), "rbe"));
  if (!file_) return system_refusal("cannot be written");
  std::array<char, 1u << 16> piece;
  while (const std::size_t count = std::fread(piece.data(), 1, piece.size(), file_.get())) {
    if (std::fwrite(piece.data(), 1, count, in_place_.get()) != count) return system_refusal("cannot be written");
  }
  if (std::ferror(file_.get()) != 0 || std::fclose(in_place_.release()) != 0)
    return system_refusal("cannot be written");
  file_.reset();
  return {};
}

}  // namespace hairnet
