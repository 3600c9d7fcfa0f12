#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "schema/channel/token.hpp"

namespace hairnet::server {

// Who a session belongs to. All sessions of a subject share its quotas and its part of the tick's time.
struct Subject {
  enum class Kind : std::uint8_t {
    // The session's token names it.
    token,
    // Everyone at the same address.
    address,
    // Everyone at an exempt address, such as the loopback: no limits of a subject apply.
    exempt,
  };
  Kind kind = Kind::exempt;
  // The log has it, too: "sub:alice", "name:Alice", "address:192.0.2.1", "exempt".
  std::string name = "exempt";
  // Where the quotas of the session's token are counted: `name`, or the token itself when it names no subject.
  std::string token_holder = "exempt";
};

// The name of a token's subject: its `sub`, else its `name`; empty when it has neither.
std::string subject_name(const channel::TokenClaims& claims);
// `claims` are those of `token`; none when the server needs no token. `network`: Connection::network().
Subject subject_of(const std::optional<channel::TokenClaims>& claims, std::string_view token, std::string_view network);

}  // namespace hairnet::server
