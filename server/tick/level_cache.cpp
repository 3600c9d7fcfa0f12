#include "server/tick/level_cache.hpp"

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
#include <vector>

#include "schema/wire/level_file.hpp"
#include "server/room/log_text.hpp"

namespace hairnet::server {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kSuffix = ".hnlevels", kPartSuffix = ".part-";
constexpr auto kWriting = std::chrono::hours(1);  // longer, and who wrote it is dead
constexpr std::size_t kHashDigits = 2 * sizeof(wire::GroomHash);

class Descriptor {
 public:
  explicit Descriptor(int descriptor) : descriptor_(descriptor) {}
  ~Descriptor() {
    if (descriptor_ >= 0) ::close(descriptor_);
  }
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  explicit operator bool() const { return descriptor_ >= 0; }
  [[nodiscard]] int get() const { return descriptor_; }
  // What has been written is known to be so only after this. False when it is not.
  bool close() { return ::close(std::exchange(descriptor_, -1)) == 0; }

 private:
  int descriptor_;
};

// False, with errno set, when not all were written.
bool write_all(int descriptor, std::span<const std::uint8_t> bytes) {
  while (!bytes.empty()) {
    const ssize_t written = ::write(descriptor, bytes.data(), bytes.size());
    if (written < 0 && errno == EINTR) continue;
    if (written < 0) return false;
    bytes = bytes.subspan(static_cast<std::size_t>(written));
  }
  return true;
}

// `size` bytes, or up to the end; nullopt with errno set.
std::optional<std::vector<std::uint8_t>> read_all(int descriptor, std::size_t size) {
  std::vector<std::uint8_t> bytes(size);
  std::size_t count = 0;
  while (count < size) {
    const ssize_t got = ::read(descriptor, bytes.data() + count, size - count);
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) return std::nullopt;
    if (got == 0) break;
    count += static_cast<std::size_t>(got);
  }
  bytes.resize(count);
  return bytes;
}

// Ours, whole or left by a server that died while it wrote; nothing else in the folder is touched.
bool is_ours(const std::string& name) {
  const auto is_hex = [](char c) { return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'f'); };
  if (name.size() < kHashDigits + kSuffix.size() || !std::all_of(name.begin(), name.begin() + kHashDigits, is_hex))
    return false;
  const std::string_view rest = std::string_view(name).substr(kHashDigits);
  return rest == kSuffix || (rest.starts_with(kSuffix) && rest.substr(kSuffix.size()).starts_with(kPartSuffix));
}

struct CacheFile {
  fs::file_time_type used;
  fs::path path;
  std::uint64_t bytes = 0;

  [[nodiscard]] bool is_being_written(fs::file_time_type now) const {
    return path.extension() != kSuffix && now - used < kWriting;
  }
};

std::vector<CacheFile> files_of(const fs::path& folder) {
  std::vector<CacheFile> files;
  std::error_code error;
  for (fs::directory_iterator entry(folder, error), end; !error && entry != end; entry.increment(error)) {
    std::error_code gone;  // another server may remove it meanwhile
    if (!is_ours(entry->path().filename().string()) || !fs::is_regular_file(entry->symlink_status(gone))) continue;
    CacheFile file{entry->last_write_time(gone), entry->path(), 0};
    if (!gone) file.bytes = entry->file_size(gone);
    if (!gone) files.push_back(std::move(file));
  }
  return files;
}

}  // namespace

LevelCache::LevelCache(fs::path folder, std::uint64_t bytes_max, LevelCacheCounters& counters)
    : folder_(std::move(folder)), bytes_max_(bytes_max), counters_(&counters) {
  std::error_code error;
  if (fs::is_directory(folder_, error)) return;
  if (fs::create_directories(folder_, error); error) {
    warn_once(error.message());
  } else {
    fs::permissions(folder_, fs::perms::owner_all, error);
  }
}

std::shared_ptr<LevelSet> LevelCache::find(const wire::GroomHash& groom) {
  const fs::path path = path_of(groom);
  // Not blocking: whatever else may lie there under that name, a pipe among them, must not hold the builder up.
  const Descriptor file(::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK));
  if (!file && (errno == ENOENT || errno == ENOTDIR)) {
    counters_->level_cache_misses.add();
    return nullptr;
  }
  struct stat status {};
  if (!file || ::fstat(file.get(), &status) != 0 || !S_ISREG(status.st_mode)) {
    count("cannot be read", path, counters_->level_cache_rejected_unreadable);
    return nullptr;
  }
  if (static_cast<std::uint64_t>(status.st_size) > wire::kLevelFileBytesMax) {
    count("too large", path, counters_->level_cache_rejected_damaged);
    return nullptr;
  }
  const auto bytes = read_all(file.get(), static_cast<std::size_t>(status.st_size));
  if (!bytes) {
    count("cannot be read", path, counters_->level_cache_rejected_unreadable);
    return nullptr;
  }
  wire::DecodedLevels decoded = wire::decode_levels(*bytes, groom);
  switch (decoded.fault) {
    case wire::LevelFileFault::none:
      break;
    case wire::LevelFileFault::not_a_level_file:
      count(decoded.detail, path, counters_->level_cache_rejected_format);
      return nullptr;
    case wire::LevelFileFault::other_version:
      count(decoded.detail, path, counters_->level_cache_rejected_version);
      return nullptr;
    case wire::LevelFileFault::other_groom:
      count(decoded.detail, path, counters_->level_cache_rejected_groom);
      return nullptr;
    case wire::LevelFileFault::damaged:
      count(decoded.detail, path, counters_->level_cache_rejected_damaged);
      return nullptr;
    case wire::LevelFileFault::unsound:
      count(decoded.detail, path, counters_->level_cache_rejected_unsound);
      return nullptr;
  }
  counters_->level_cache_hits.add();
  // Its time is that of its last use. In a folder that may only be read there is nothing to remove either.
  (void)::futimens(file.get(), nullptr);
  return std::move(decoded.levels);
}

void LevelCache::put(const wire::GroomHash& groom, const LevelSet& set) {
  const std::vector<std::uint8_t> bytes = wire::encode_levels(groom, set);
  const fs::path path = path_of(groom);
  if (bytes.size() > bytes_max_ || bytes.size() > wire::kLevelFileBytesMax) {
    counters_->level_cache_writes_failed.add();
    return warn_once(fmt::format("{} bytes of levels are more than may be kept", bytes.size()));
  }
  if (const int error = write(path, bytes); error != 0) {
    counters_->level_cache_writes_failed.add();
    return warn_once(std::strerror(error));
  }
  counters_->level_cache_written.add();
  make_room(path);
}

fs::path LevelCache::path_of(const wire::GroomHash& groom) const {
  return folder_ / fmt::format("{:02x}{}", fmt::join(groom, ""), kSuffix);
}

void LevelCache::count(const std::string& detail, const fs::path& path, Counter& counter) {
  counter.add();
  spdlog::info("event=levels_rebuilt file={} why={}", log_text(path.string()), log_text(detail));
}

int LevelCache::write(const fs::path& path, std::span<const std::uint8_t> bytes) const {
  std::string part = fmt::format("{}{}XXXXXX", path.string(), kPartSuffix);
  Descriptor file(::mkostemp(part.data(), O_CLOEXEC));
  if (!file) return errno;
  // Not synced: what a crash of the machine leaves of it has another checksum, and is built anew.
  if (write_all(file.get(), bytes) && file.close() && ::rename(part.c_str(), path.c_str()) == 0) return 0;
  const int error = errno;
  ::unlink(part.c_str());
  return error;
}

void LevelCache::warn_once(const std::string& what) {
  if (!warned_) spdlog::warn("event=levels_not_kept folder={} why={}", log_text(folder_.string()), log_text(what));
  warned_ = true;
}

void LevelCache::make_room(const fs::path& newest) {
  std::vector<CacheFile> files = files_of(folder_);
  std::ranges::sort(files, {}, [](const CacheFile& file) { return std::tie(file.used, file.path); });
  std::error_code gone;
  const fs::file_time_type now = fs::last_write_time(newest, gone);
  if (gone) return;  // another server has made room already
  std::uint64_t bytes = 0;
  for (const CacheFile& file : files) bytes += file.bytes;
  for (const CacheFile& file : files) {
    if (bytes <= bytes_max_) return;
    std::error_code error;
    if (file.path == newest || file.is_being_written(now) || !fs::remove(file.path, error)) continue;
    counters_->level_cache_evicted.add();
    bytes -= file.bytes;
  }
}

}  // namespace hairnet::server
