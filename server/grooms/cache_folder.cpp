#include "server/grooms/cache_folder.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <spdlog/spdlog.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstdlib>
#include <cstring>
#include <optional>
#include <tuple>
#include <utility>

#include "core/assert.hpp"
#include "server/files/descriptor.hpp"
#include "server/telemetry/log_text.hpp"

namespace hairnet::server {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kPartSuffix = ".part-";
// An older partial file was left by a server that died, because no write takes an hour; make_room() may remove it.
constexpr auto kWriting = std::chrono::hours(1);
constexpr std::size_t kHashDigits = 2 * sizeof(wire::GroomHash);
constexpr std::string_view kDigits = "0123456789abcdef";

// Returns false, with errno set, when not all bytes were written.
bool write_all(int descriptor, std::span<const std::uint8_t> bytes) {
  while (!bytes.empty()) {
    const ssize_t written = ::write(descriptor, bytes.data(), bytes.size());
    if (written < 0 && errno == EINTR) continue;
    if (written < 0) return false;
    HAIRNET_ASSERT(std::cmp_less_equal(written, bytes.size()));
    bytes = bytes.subspan(static_cast<std::size_t>(written));
  }
  return true;
}

// Reads `size` bytes, or up to the end; nullopt with errno set.
std::optional<std::vector<std::uint8_t>> read_all(int descriptor, std::size_t size) {
  std::vector<std::uint8_t> bytes(size);
  std::size_t count = 0;
  while (count < size) {
    const ssize_t got = ::read(descriptor, bytes.data() + count, size - count);
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) return std::nullopt;
    if (got == 0) break;
    HAIRNET_ASSERT(std::cmp_less_equal(got, size - count));
    count += static_cast<std::size_t>(got);
  }
  bytes.resize(count);
  return bytes;
}

// Only names that begin with a groom's hash belong to a cache, so that a folder with other files loses none of them.
bool begins_with_hash(std::string_view name) {
  return name.size() >= kHashDigits && name.substr(0, kHashDigits).find_first_not_of(kDigits) == name.npos;
}

wire::GroomHash hash_of(std::string_view name) {
  HAIRNET_ASSERT(begins_with_hash(name));
  wire::GroomHash hash{};
  for (std::size_t i = 0; i < hash.size(); ++i)
    hash[i] = static_cast<std::uint8_t>(16 * kDigits.find(name[2 * i]) + kDigits.find(name[2 * i + 1]));
  return hash;
}

struct CacheFile {
  fs::file_time_type used;
  fs::path path;
  std::uint64_t bytes = 0;
  // False: the file is being written, or was left by a server that died during the write.
  bool whole = true;

  [[nodiscard]] bool is_being_written(fs::file_time_type now) const { return !whole && now - used < kWriting; }
};

// The files of this cache; nothing else in the folder is touched.
std::vector<CacheFile> files_of(const fs::path& folder, std::string_view suffix) {
  std::vector<CacheFile> files;
  std::error_code error;
  for (fs::directory_iterator entry(folder, error), end; !error && entry != end; entry.increment(error)) {
    const std::string name = entry->path().filename().string();
    if (!begins_with_hash(name)) continue;
    const std::string_view rest = std::string_view(name).substr(kHashDigits);
    const bool whole = rest == suffix;
    if (!whole && !(rest.starts_with(suffix) && rest.substr(suffix.size()).starts_with(kPartSuffix))) continue;
    // Another server may remove the file meanwhile: then it is skipped.
    std::error_code gone;
    // Links are not followed: a link in the folder must not make the server remove or count files elsewhere.
    if (!fs::is_regular_file(entry->symlink_status(gone))) continue;
    CacheFile file{entry->last_write_time(gone), entry->path(), 0, whole};
    if (!gone) file.bytes = entry->file_size(gone);
    if (!gone) files.push_back(std::move(file));
  }
  return files;
}

}  // namespace

CacheFolder::CacheFolder(CacheFolderDef def, Counter& written, Counter& writes_failed, Counter& evicted)
    : def_(std::move(def)), written_(&written), writes_failed_(&writes_failed), evicted_(&evicted) {
  HAIRNET_ASSERT(!def_.folder.empty());
  HAIRNET_ASSERT(def_.suffix.starts_with('.'));
  HAIRNET_ASSERT(def_.file_bytes_max > 0);
  std::error_code error;
  if (fs::is_directory(def_.folder, error)) return;
  if (fs::create_directories(def_.folder, error); error) {
    warn_once(error.message());
  } else {
    // Others on the machine must not replace everyone's hair. An existing folder keeps the rights that its owner has
    // chosen.
    fs::permissions(def_.folder, fs::perms::owner_all, error);
  }
}

CacheFolder::Found CacheFolder::read(const wire::GroomHash& groom) const {
  // O_NONBLOCK: the name may belong to a pipe, and opening a pipe would block.
  const Descriptor file(::open(path_of(groom).c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK));
  if (!file && (errno == ENOENT || errno == ENOTDIR)) return {Outcome::absent, {}};
  struct stat status {};
  if (!file || ::fstat(file.get(), &status) != 0 || !S_ISREG(status.st_mode)) return {Outcome::unreadable, {}};
  // The size is checked before memory is taken for it.
  if (static_cast<std::uint64_t>(status.st_size) > def_.file_bytes_max) return {Outcome::too_large, {}};
  // The file may be replaced meanwhile by a rename: the descriptor keeps the old one, which is whole.
  auto bytes = read_all(file.get(), static_cast<std::size_t>(status.st_size));
  if (!bytes) return {Outcome::unreadable, {}};
  return {Outcome::read, std::move(*bytes)};
}

void CacheFolder::touch(const wire::GroomHash& groom) const {
  // An error does not matter: in a read-only folder make_room() removes nothing either.
  (void)::utimensat(AT_FDCWD, path_of(groom).c_str(), nullptr, AT_SYMLINK_NOFOLLOW);
}

bool CacheFolder::put(const wire::GroomHash& groom, std::span<const std::uint8_t> bytes) {
  const fs::path path = path_of(groom);
  if (bytes.size() > def_.bytes_max || bytes.size() > def_.file_bytes_max) {
    writes_failed_->add();
    warn_once(fmt::format("{} bytes of {} are more than may be kept", bytes.size(), def_.contents));
    return false;
  }
  if (const int error = write(path, bytes); error != 0) {
    writes_failed_->add();
    warn_once(std::strerror(error));
    return false;
  }
  written_->add();
  make_room(path);
  return true;
}

void CacheFolder::remove(const wire::GroomHash& groom) const {
  std::error_code error;
  const fs::path path = path_of(groom);
  if (fs::is_regular_file(fs::symlink_status(path, error))) fs::remove(path, error);
}

std::vector<wire::GroomHash> CacheFolder::hashes() const {
  std::vector<wire::GroomHash> hashes;
  for (const CacheFile& file : files_of(def_.folder, def_.suffix)) {
    if (file.whole) hashes.push_back(hash_of(file.path.filename().string()));
  }
  return hashes;
}

fs::path CacheFolder::path_of(const wire::GroomHash& groom) const {
  return def_.folder / fmt::format("{:02x}{}", fmt::join(groom, ""), def_.suffix);
}

int CacheFolder::write(const fs::path& path, std::span<const std::uint8_t> bytes) const {
  // The name is random and the file exclusive, so servers that write the same groom do not meet. rename() replaces the
  // file in one step: readers find the old or the new one, never half of it.
  std::string part = fmt::format("{}{}XXXXXX", path.string(), kPartSuffix);
  Descriptor file(::mkostemp(part.data(), O_CLOEXEC));
  if (!file) return errno;
  // The file is not synced: a file that a crash of the machine damages has another checksum, and counts as absent.
  if (write_all(file.get(), bytes) && file.close() && ::rename(part.c_str(), path.c_str()) == 0) return 0;
  const int error = errno;
  ::unlink(part.c_str());
  return error;
}

void CacheFolder::warn_once(std::string_view what) {
  // A full disk fails every write: one line is enough, and the counter has the rest.
  if (!warned_.exchange(true))
    spdlog::warn("event={} folder={} detail={}", def_.write_failed_event, log_text(def_.folder.string()),
                 log_text(what));
}

void CacheFolder::make_room(const fs::path& newest) {
  std::vector<CacheFile> files = files_of(def_.folder, def_.suffix);
  std::ranges::sort(files, {}, [](const CacheFile& file) { return std::tie(file.used, file.path); });
  std::error_code gone;
  // The time is that of the file system, and not of this machine: a network file system may have another clock, which
  // has set the times of all its files.
  const fs::file_time_type now = fs::last_write_time(newest, gone);
  // Another server has made room already.
  if (gone) return;
  std::uint64_t bytes = 0;
  std::size_t count = files.size();
  for (const CacheFile& file : files) bytes += file.bytes;
  for (const CacheFile& file : files) {
    if (bytes <= def_.bytes_max && count <= def_.file_count_max) return;
    std::error_code error;
    // What was just written stays even if it alone exceeds the bound, and another server's write is not disturbed.
    if (file.path == newest || file.is_being_written(now) || !fs::remove(file.path, error)) continue;
    evicted_->add();
    HAIRNET_ASSERT(bytes >= file.bytes);
    bytes -= file.bytes;
    --count;
  }
}

}  // namespace hairnet::server
