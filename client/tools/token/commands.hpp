#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "core/result.hpp"
#include "schema/channel/token.hpp"

namespace hairnet::token {

// What a new token grants, and for how long.
struct MakeOptions {
  std::string key_file;
  // The times in it are not used: the next two fields set them, in seconds from now.
  channel::TokenClaims claims;
  // Both count seconds from now. Without not_before_s the token is valid at once.
  std::int64_t expires_s = 3600;
  std::optional<std::int64_t> not_before_s;
};
// A token, and the key with which it should be signed.
struct ShowOptions {
  std::string key_file;
  std::string token;
};

// Each returns the text to print, or one line about the error. They read the key's file, but no clock: `now_s` counts
// seconds since 1970. A key is a secret: the caller decides where its text goes.
Result<std::string> make_key();
Result<std::string> make_token(const MakeOptions& options, std::int64_t now_s);
// Returns the claims as JSON, and whether the token is valid at `now_s`. A token of another key is refused with the
// reason.
Result<std::string> show_token(const ShowOptions& options, std::int64_t now_s);

}  // namespace hairnet::token
