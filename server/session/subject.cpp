#include "server/session/subject.hpp"

namespace hairnet::server {

std::string subject_name(const channel::TokenClaims& claims) {
  // The prefix keeps a `sub` apart from an equal `name`, and both from an address: no user can take another kind's
  // name.
  if (!claims.subject.empty()) return "sub:" + claims.subject;
  if (!claims.name.empty()) return "name:" + claims.name;
  return {};
}

Subject subject_of(const std::optional<channel::TokenClaims>& claims, std::string_view token,
                   std::string_view network) {
  Subject subject;
  if (claims) subject.name = subject_name(*claims);
  if (claims && !subject.name.empty()) {
    subject.kind = Subject::Kind::token;
    subject.token_holder = subject.name;
    return subject;
  }
  subject.kind = network.empty() ? Subject::Kind::exempt : Subject::Kind::address;
  subject.name = network.empty() ? "exempt" : "address:" + std::string(network);
  // A token without a name is its own holder. Its signature stands for it, because it differs wherever tokens differ.
  subject.token_holder = claims ? "token:" + std::string(token.substr(token.rfind('.') + 1)) : subject.name;
  return subject;
}

}  // namespace hairnet::server
