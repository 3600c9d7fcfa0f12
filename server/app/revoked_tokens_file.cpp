#include "server/app/revoked_tokens_file.hpp"

#include <spdlog/spdlog.h>

#include <fstream>
#include <system_error>

#include "server/telemetry/log_text.hpp"

namespace hairnet::server {
namespace {

constexpr std::int64_t kLookInterval_ns = 1'000'000'000;
constexpr std::uintmax_t kRevokedTokensFileBytesMax = std::uintmax_t{64} << 20;

}  // namespace

void RevokedTokensFile::poll(RevokedTokens& tokens, std::int64_t now_ns) {
  if (now_ns < due_ns_) return;
  due_ns_ = now_ns + kLookInterval_ns;
  const bool had_failed = has_failed_;
  has_failed_ = !read(tokens);
  if (has_failed_ && !had_failed) spdlog::error("event=revoked_tokens_failed file={}", log_text(path_));
}

bool RevokedTokensFile::read(RevokedTokens& tokens) {
  std::error_code of_time, of_size;
  // Taken before the file is read: a change during the read is found at the next look.
  const auto changed = std::filesystem::last_write_time(path_, of_time);
  const std::uintmax_t bytes = std::filesystem::file_size(path_, of_size);
  if (of_time || of_size || bytes > kRevokedTokensFileBytesMax) return false;
  if (is_read_ && changed == changed_ && bytes == bytes_) return true;
  std::ifstream file(path_, std::ios::binary);
  std::string lines(static_cast<std::size_t>(bytes), '\0');
  if (!file.read(lines.data(), static_cast<std::streamsize>(lines.size()))) return false;
  tokens = RevokedTokens(lines);
  changed_ = changed;
  bytes_ = bytes;
  is_read_ = true;
  spdlog::info("event=revoked_tokens_read file={}", log_text(path_));
  return true;
}

}  // namespace hairnet::server
