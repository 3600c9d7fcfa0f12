#include "server/transport/static_files.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <utility>

#include "core/assert.hpp"
#include "server/files/descriptor.hpp"

namespace hairnet::server {
namespace {

// Bounds the system calls that one request can cause.
constexpr std::size_t kDepthMax = 16;

// The type of unknown files: a browser then stores the file and runs nothing.
constexpr std::string_view kUnknownType = "application/octet-stream";

// The types of files by their endings.
constexpr std::array<std::pair<std::string_view, std::string_view>, 24> kTypes{{
    {".html", "text/html; charset=utf-8"},
    {".js", "text/javascript; charset=utf-8"},
    {".mjs", "text/javascript; charset=utf-8"},
    {".css", "text/css; charset=utf-8"},
    {".json", "application/json"},
    {".map", "application/json"},
    {".webmanifest", "application/manifest+json"},
    {".wasm", "application/wasm"},
    {".txt", "text/plain; charset=utf-8"},
    {".md", "text/plain; charset=utf-8"},
    {".glsl", "text/plain; charset=utf-8"},
    {".svg", "image/svg+xml"},
    {".png", "image/png"},
    {".jpg", "image/jpeg"},
    {".jpeg", "image/jpeg"},
    {".webp", "image/webp"},
    {".avif", "image/avif"},
    {".ico", "image/x-icon"},
    {".hdr", "image/vnd.radiance"},
    {".ktx2", "image/ktx2"},
    {".woff2", "font/woff2"},
    {".glb", "model/gltf-binary"},
    {".gltf", "model/gltf+json"},
    {".groom", "application/octet-stream"},
}};

std::string_view type_of(std::string_view name) {
  const std::size_t dot = name.rfind('.');
  if (dot == std::string_view::npos) return kUnknownType;
  const auto found = std::ranges::find(kTypes, name.substr(dot), &std::pair<std::string_view, std::string_view>::first);
  return found == kTypes.end() ? kUnknownType : found->second;
}

// The value of a hexadecimal digit, or -1.
int hex_value(char c) {
  if (c >= '0' && c <= '9') return c - '0';
  if (c >= 'a' && c <= 'f') return c - 'a' + 10;
  if (c >= 'A' && c <= 'F') return c - 'A' + 10;
  return -1;
}

bool is_control(char c) {
  return static_cast<unsigned char>(c) < 0x20 || c == 0x7f;
}

// Whether the name contains a hash of the file's content, as bundlers write it ("index-4f3a9b1c.js"). Such a file never
// changes.
bool is_hashed(std::string_view name) {
  const std::size_t dot = name.rfind('.');
  const std::size_t dash = name.rfind('-', dot);
  if (dot == std::string_view::npos || dash == std::string_view::npos) return false;
  const std::string_view hash = name.substr(dash + 1, dot - dash - 1);
  // A word such as "index-settings.js" has no digit, so it does not pass for a hash and is asked for again.
  return hash.size() >= 8 &&
         std::ranges::all_of(hash, [](char c) { return std::isalnum(static_cast<unsigned char>(c)); }) &&
         std::ranges::any_of(hash, [](char c) { return c >= '0' && c <= '9'; });
}

// Time and size stand for the content: a hash would read the whole file for each request. The ending tells the copies
// apart, as a cache may hold several.
std::string etag_of(const struct stat& status, std::string_view ending) {
  std::array<char, 64> text;
  const auto time_ns = status.st_mtim.tv_sec * 1'000'000'000LL + status.st_mtim.tv_nsec;
  std::snprintf(text.data(), text.size(), "\"%llx-%llx%.*s\"", static_cast<unsigned long long>(time_ns),
                static_cast<unsigned long long>(status.st_size), static_cast<int>(ending.size()), ending.data());
  return text.data();
}

// Opens a name in the folder and reads its status. O_NONBLOCK: opening a pipe without a writer would block. O_NOFOLLOW:
// a symbolic link is refused.
bool open_and_stat(int folder, const std::string& name, Descriptor& opened, struct stat& status) {
  opened.reset(::openat(folder, name.c_str(), O_RDONLY | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC));
  return opened && ::fstat(opened.get(), &status) == 0;
}

}  // namespace

StaticFile::StaticFile(StaticFile&& other) noexcept {
  *this = std::move(other);
}

StaticFile& StaticFile::operator=(StaticFile&& other) noexcept {
  if (this == &other) return *this;
  if (descriptor_ >= 0) ::close(descriptor_);
  descriptor_ = std::exchange(other.descriptor_, -1);
  bytes = other.bytes;
  etag = std::move(other.etag);
  content_type = std::move(other.content_type);
  cache_control = std::move(other.cache_control);
  content_encoding = std::move(other.content_encoding);
  return *this;
}

StaticFile::~StaticFile() {
  if (descriptor_ >= 0) ::close(descriptor_);
}

std::size_t StaticFile::read(std::uint64_t offset, std::span<std::uint8_t> into) const {
  HAIRNET_ASSERT(descriptor_ >= 0);
  const ssize_t count = ::pread(descriptor_, into.data(), into.size(), static_cast<off_t>(offset));
  return count > 0 ? static_cast<std::size_t>(count) : 0;
}

Result<std::unique_ptr<StaticFiles>> StaticFiles::open(const std::string& folder) {
  // O_PATH needs no right to list the folder. The descriptor stays on this folder when its name later means another
  // one.
  const int descriptor = ::open(folder.c_str(), O_PATH | O_DIRECTORY | O_CLOEXEC);
  if (descriptor < 0) return Refusal("cannot open the web root " + folder + ": " + std::strerror(errno));
  return std::unique_ptr<StaticFiles>(new StaticFiles(descriptor));
}

StaticFiles::~StaticFiles() {
  ::close(folder_);
}

StaticFind StaticFiles::find(std::string_view path, StaticFile& file, const std::vector<ContentCoding>& codings) const {
  std::string decoded;
  // Decoding happens once: a path decoded twice could become a "..", which the first check did not see.
  if (!decode_path(path, decoded)) return StaticFind::bad_path;
  if (decoded.ends_with('/')) decoded += "index.html";

  HAIRNET_ASSERT(decoded.starts_with('/'));
  std::string_view rest = std::string_view(decoded).substr(1);
  Descriptor folder(-1);
  for (std::size_t depth = 0; depth < kDepthMax; ++depth) {
    const std::size_t slash = rest.find('/');
    const std::string name(rest.substr(0, slash));
    // This refuses "..", hidden files and "//" alike.
    if (name.empty() || name.starts_with('.')) return StaticFind::not_found;
    const int from = folder ? folder.get() : folder_;
    if (slash != std::string_view::npos) {
      // O_NOFOLLOW refuses a symbolic link in each step, also one that somebody makes during the walk. A check of the
      // whole path before opening it would lose that race.
      folder.reset(::openat(from, name.c_str(), O_PATH | O_DIRECTORY | O_NOFOLLOW | O_CLOEXEC));
      if (!folder) return StaticFind::not_found;
      rest.remove_prefix(slash + 1);
      continue;
    }
    Descriptor opened(-1);
    struct stat status {};
    if (!open_and_stat(from, name, opened, status)) return StaticFind::not_found;
    // Relative links in a page resolve against the address, so a folder's page needs the '/' at its end.
    if (S_ISDIR(status.st_mode)) return StaticFind::is_folder;
    if (!S_ISREG(status.st_mode)) return StaticFind::not_found;
    ContentCodingName coding;
    for (const ContentCoding wanted : codings) {
      coding = name_of(wanted);
      if (coding.ending.empty()) break;
      Descriptor copy(-1);
      struct stat of_copy {};
      // A compressed copy counts only beside its file, which was opened first and gives the type.
      if (!open_and_stat(from, name + std::string(coding.ending), copy, of_copy) || !S_ISREG(of_copy.st_mode)) continue;
      opened.reset(copy.release());
      status = of_copy;
      break;
    }
    file = StaticFile();
    file.descriptor_ = opened.release();
    file.bytes = static_cast<std::uint64_t>(status.st_size);
    file.etag = etag_of(status, coding.ending);
    file.content_encoding = coding.token;
    file.content_type = type_of(name);
    // A new version of a hashed file has a new name, so the old one may be kept; every other file is asked for each
    // time, and mostly answered by 304.
    file.cache_control = is_hashed(name) ? "public, max-age=31536000, immutable" : "no-cache";
    return StaticFind::found;
  }
  return StaticFind::not_found;
}

bool decode_path(std::string_view path, std::string& decoded) {
  decoded.clear();
  if (!path.starts_with('/')) return false;
  for (std::size_t i = 0; i < path.size(); ++i) {
    char c = path[i];
    if (c == '%') {
      if (i + 2 >= path.size()) return false;
      const int high = hex_value(path[i + 1]), low = hex_value(path[i + 2]);
      if (high < 0 || low < 0) return false;
      c = static_cast<char>(high * 16 + low);
      // An encoded slash is refused, because the name of a file cannot contain one.
      if (c == '/') return false;
      i += 2;
    }
    // A backslash separates folders for some programs that read the same address.
    if (is_control(c) || c == '\\') return false;
    decoded += c;
  }
  HAIRNET_ASSERT(decoded.size() <= path.size());
  return true;
}

}  // namespace hairnet::server
