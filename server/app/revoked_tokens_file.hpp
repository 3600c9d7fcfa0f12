#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <utility>

#include "server/session/revoked_tokens.hpp"

namespace hairnet::server {

// The file of revoked tokens, which is read again when it changes. I/O thread.
class RevokedTokensFile {
 public:
  explicit RevokedTokensFile(std::string path) : path_(std::move(path)) {}

  // Reads the file when its time or size has changed, and looks at most once a second. While the file cannot be read,
  // `tokens` stays as it is, and the log says so once.
  void poll(RevokedTokens& tokens, std::int64_t now_ns);
  [[nodiscard]] bool has_failed() const { return has_failed_; }

 private:
  bool read(RevokedTokens& tokens);

  std::string path_;
  std::filesystem::file_time_type changed_;  // of the text that was read last
  std::uintmax_t bytes_ = 0;
  bool is_read_ = false, has_failed_ = false;
  std::int64_t due_ns_ = 0;
};

}  // namespace hairnet::server
