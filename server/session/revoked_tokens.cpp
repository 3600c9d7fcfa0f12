#include "server/session/revoked_tokens.hpp"

#include <algorithm>

namespace hairnet::server {

RevokedTokens::RevokedTokens(std::string_view lines) {
  constexpr std::string_view kSpaces = " \t\r";
  while (!lines.empty()) {
    const std::size_t end = std::min(lines.find('\n'), lines.size());
    std::string_view line = lines.substr(0, end);
    lines.remove_prefix(std::min(end + 1, lines.size()));
    line.remove_prefix(std::min(line.find_first_not_of(kSpaces), line.size()));
    line = line.substr(0, line.find_last_not_of(kSpaces) + 1);
    if (!line.empty()) names_.emplace(line);
  }
}

bool RevokedTokens::contains(const channel::TokenClaims& claims) const {
  const std::string& subject = claims.subject.empty() ? claims.name : claims.subject;
  // No line is empty, so a claim that is missing, which is an empty text, matches none.
  return names_.contains(claims.id) || names_.contains(subject);
}

}  // namespace hairnet::server
