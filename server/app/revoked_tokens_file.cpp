#include "server/app/revoked_tokens_file.hpp"

#include <spdlog/spdlog.h>

#include <system_error>
#include <utility>

#include "server/files/files.hpp"
#include "server/telemetry/log_text.hpp"

namespace hairnet::server {
namespace {

// A revoked token is noticed within a second; a look costs two system calls.
constexpr std::int64_t kLookInterval_ns = 1'000'000'000;
// Bounds the memory and the time on the I/O thread that a wrong path could cost.
constexpr std::size_t kRevokedTokensFileBytesMax = std::size_t{64} << 20;

}  // namespace

const std::string& RevokedTokensFile::poll(RevokedTokens& tokens, std::int64_t now_ns) {
  if (now_ns < due_ns_) return error_;
  due_ns_ = now_ns + kLookInterval_ns;
  std::string error = read(tokens);
  // An error at the first read refuses the start (Server::create), so only later ones are logged.
  if (is_read_ && !error.empty() && error != error_)
    spdlog::error("event=revoked_tokens_failed file={} detail={} count={}", log_text(path_), log_text(error),
                  tokens.count());
  error_ = std::move(error);
  return error_;
}

std::string RevokedTokensFile::read(RevokedTokens& tokens) {
  std::error_code of_time, of_size;
  // The time is taken before the file is read: a change during the read is found at the next look.
  const auto changed = std::filesystem::last_write_time(path_, of_time);
  const std::uintmax_t bytes = std::filesystem::file_size(path_, of_size);
  if (is_read_ && !of_time && !of_size && changed == changed_ && bytes == bytes_) return {};
  const Result<std::string> text = read_text_file(path_, kRevokedTokensFileBytesMax);
  if (!text) return text.error();
  // An empty file is more likely a write that failed than the wish to allow all tokens again.
  if (text->empty() && tokens.count() > 0) return "is empty: the tokens that it named stay revoked";
  tokens = RevokedTokens(*text);
  changed_ = changed;
  bytes_ = bytes;
  is_read_ = !of_time && !of_size;
  spdlog::info("event=revoked_tokens_read file={} count={}", log_text(path_), tokens.count());
  return {};
}

}  // namespace hairnet::server
