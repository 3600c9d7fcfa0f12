#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <tl/expected.hpp>

#include "schema/channel/jwt.hpp"
#include "schema/enums.hpp"

namespace hairnet::channel {

// The rights that a token grants. As claims of a JSON Web Token, in this order: room, role, exp, nbf, characters_max,
// strands_max, name, sub, jti, upload, wind, touch, props, moderate. Other claims are ignored, except `aud`, which must
// name "hairnet" if it is present. A text of at most kTokenNameBytesMax bytes is empty when the token lacks it.
struct TokenClaims {
  // None means any room.
  std::optional<std::string> room;
  wire::Role role = wire::Role::participant;
  // The time from which on the token is invalid, in seconds since 1970.
  std::int64_t expires_s = 0;
  // The token is invalid until then.
  std::optional<std::int64_t> not_before_s;
  // The most characters of all sessions of the subject together. None means the server's own limit, here and below.
  std::optional<std::uint32_t> characters_max;
  // The most strands of all grooms of these sessions together.
  std::optional<std::uint64_t> strands_max;
  // The name of the person, for people and logs.
  std::string name;
  // The claim `sub`: the person whose token it is, for quotas and shares.
  std::string subject;
  // The claim `jti`: names this token, so that it can be revoked.
  std::string id;
  // May upload grooms; none: a participant may, an observer may not.
  std::optional<bool> upload;
  // May set the wind of the room; none: as the server is set.
  std::optional<bool> wind;
  // May touch the hair of others who allow it; none: a participant may, an observer may not.
  std::optional<bool> touch;
  // May set the props of the room; none: as the server is set.
  std::optional<bool> props;
  // May remove and mute others of the room, and lock it.
  bool moderate = false;

  friend bool operator==(const TokenClaims&, const TokenClaims&) = default;
};

// The most bytes of `name`, `sub` and `jti` each, so that every token fits kTokenBytesMax.
inline constexpr std::size_t kTokenNameBytesMax = 256;
// This is the end of the year 9999.
inline constexpr std::int64_t kTokenTimeMax_s = 253'402'300'799;

enum class TokenRefusal : std::uint8_t {
  // The text is not one of our tokens, or a claim is missing, of a wrong type or out of range.
  malformed,
  // The token is not signed with this key.
  bad_signature,
  expired,
  not_yet,
  // The token was made for another service.
  wrong_audience,
  wrong_room,
};
std::string_view to_string(TokenRefusal refusal);
// One line for the person who has the token: what is wrong with it, and what to do. It tells nothing that the token
// itself does not say. `token`, `key` and `room` are those that were verified.
std::string explain(TokenRefusal refusal, std::string_view token, const TokenKey& key, std::string_view room);

// Returns an empty string when the claims can be signed; else one line with the reason.
std::string validate(const TokenClaims& claims);
// Asserts that `claims` are valid and `key` is not empty.
std::string sign(const TokenClaims& claims, const TokenKey& key);

// Verifies that the text is a token signed with this key that is valid now and in `room`. Accepts untrusted text. Reads
// no clock: `now_s` is in seconds since 1970.
tl::expected<TokenClaims, TokenRefusal> verify(std::string_view token, const TokenKey& key, std::int64_t now_s,
                                               std::string_view room);
// Returns the claims of a token signed with this key, without checking times and room.
tl::expected<TokenClaims, TokenRefusal> read_claims(std::string_view token, const TokenKey& key);

}  // namespace hairnet::channel
