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

  // Reads the file when its time or size has changed, and looks at most once a second. `tokens` stays as it is while
  // the file cannot be read, and also when the file has become empty: the tool that writes it may have failed, and all
  // revoked people would come in again. To clear the list, write a file with one blank line. The log tells each error
  // once. Returns the error; empty when there is none.
  const std::string& poll(RevokedTokens& tokens, std::int64_t now_ns);

 private:
  std::string read(RevokedTokens& tokens);

  std::string path_, error_;
  // The text that was read last had this time and this size.
  std::filesystem::file_time_type changed_;
  std::uintmax_t bytes_ = 0;
  bool is_read_ = false;
  std::int64_t due_ns_ = 0;
};

}  // namespace hairnet::server
