#pragma once

#include <string>
#include <string_view>
#include <unordered_set>

#include "schema/channel/token.hpp"

namespace hairnet::server {

// Tokens that the server refuses before they expire. The operator's file gives their names; app/ reads the file again
// when it changes. A name is compared with `jti` and with subject, so a `jti` equal to another's subject revokes both.
// I/O thread.
class RevokedTokens {
 public:
  RevokedTokens() = default;
  // A line names one token by its `jti`, or all tokens of a subject by their `sub` or, if they have none, their `name`.
  // Spaces around it, and empty lines, are ignored.
  explicit RevokedTokens(std::string_view lines);
  [[nodiscard]] bool contains(const channel::TokenClaims& claims) const;
  [[nodiscard]] std::size_t count() const { return names_.size(); }

 private:
  std::unordered_set<std::string> names_;
};

}  // namespace hairnet::server
