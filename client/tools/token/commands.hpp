#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "core/result.hpp"
#include "schema/channel/token.hpp"

namespace hairnet::token {

struct MakeOptions {
  std::string key_file;
  // The times in it are not used: the next two fields set them, in seconds.
  channel::TokenClaims claims;
  // Counts from now.
  std::int64_t expires_s = 3600;
  std::optional<std::int64_t> not_before_s;
};
struct ShowOptions {
  std::string key_file;
  std::string token;
};

// Each returns the text to print, or one line about the error.
Result<std::string> make_key();
Result<std::string> make_token(const MakeOptions& options, std::int64_t now_s);
// The claims as JSON, and whether the token is valid at `now_s`.
Result<std::string> show_token(const ShowOptions& options, std::int64_t now_s);

}  // namespace hairnet::token
