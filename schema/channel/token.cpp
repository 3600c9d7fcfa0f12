#include "schema/channel/token.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <ctime>
#include <limits>
#include <nlohmann/json.hpp>
#include <utility>
#include <vector>

#include "core/assert.hpp"
#include "schema/channel/flat_json.hpp"
#include "schema/limits.hpp"
#include "schema/lobby.hpp"

namespace hairnet::channel {
namespace {

// The audience that a token's `aud` must name. A token for other audiences was made for another service, though with
// the same key.
constexpr std::string_view kAudience = "hairnet";
// The greatest characters_max and strands_max of a token. TokenClaims has 32 bits for the first; a larger number is
// refused and not cut off.
constexpr std::int64_t kCharactersMax = std::numeric_limits<std::uint32_t>::max();
constexpr std::int64_t kStrandsMax = 1'000'000'000'000;

// Names stand in logs and terminals, where a control character could forge a line.
bool is_name(std::string_view text) {
  if (text.size() > kTokenNameBytesMax) return false;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const auto c = static_cast<unsigned char>(text[i]);
    if (c < 0x20 || c == 0x7f) return false;
    // U+0080 to U+009F are controls as well; the parser has checked that the text is UTF-8.
    if (c == 0xc2 && i + 1 < text.size() && static_cast<unsigned char>(text[i + 1]) < 0xa0) return false;
  }
  return true;
}

// Reads claims one by one, and remembers whether one was not valid. It goes on after such a claim, so that one check of
// valid() at the end serves all claims.
class ClaimReader {
 public:
  explicit ClaimReader(const FlatJson& claims) : claims_(&claims) {}
  [[nodiscard]] bool valid() const { return valid_; }

  // The claim as a text; none when it is absent. Another type makes the claims not valid. `boolean` and `whole` do
  // likewise.
  std::optional<std::string> text(const char* name) {
    const FlatJsonValue* value = find(name);
    if (!value) return std::nullopt;
    if (const auto* text = std::get_if<std::string>(value)) return *text;
    valid_ = false;
    return std::nullopt;
  }
  std::optional<bool> boolean(const char* name) {
    const FlatJsonValue* value = find(name);
    if (!value) return std::nullopt;
    if (const auto* boolean = std::get_if<bool>(value)) return *boolean;
    valid_ = false;
    return std::nullopt;
  }
  std::optional<std::int64_t> whole(const char* name, std::int64_t most) {
    const FlatJsonValue* value = find(name);
    if (!value) return std::nullopt;
    const auto* whole = std::get_if<std::int64_t>(value);
    if (whole && *whole >= 0 && *whole <= most) return *whole;
    valid_ = false;
    return std::nullopt;
  }
  // RFC 7519's NumericDate may have a fraction. `up` rounds it up (for `nbf`), else down (for `exp`): a fraction never
  // makes a token valid for longer.
  std::optional<std::int64_t> time_s(const char* name, bool up) {
    const FlatJsonValue* value = find(name);
    const double* number = value ? std::get_if<double>(value) : nullptr;
    if (!number) return whole(name, kTokenTimeMax_s);
    if (*number >= 0 && *number <= static_cast<double>(kTokenTimeMax_s))
      return static_cast<std::int64_t>(up ? std::ceil(*number) : std::floor(*number));
    valid_ = false;
    return std::nullopt;
  }
  // Whether `aud` is absent, or names us.
  [[nodiscard]] bool for_us() const {
    const FlatJsonValue* value = find("aud");
    if (!value) return true;
    if (const auto* one = std::get_if<std::string>(value)) return *one == kAudience;
    const auto* several = std::get_if<std::vector<std::string>>(value);
    return several && std::find(several->begin(), several->end(), kAudience) != several->end();
  }

 private:
  [[nodiscard]] const FlatJsonValue* find(const char* name) const {
    const auto found = claims_->find(name);
    return found == claims_->end() ? nullptr : &found->second;
  }

  const FlatJson* claims_;
  bool valid_ = true;
};

std::optional<wire::Role> role_of(const std::optional<std::string>& text) {
  if (text == to_string(wire::Role::participant)) return wire::Role::participant;
  if (text == to_string(wire::Role::observer)) return wire::Role::observer;
  return std::nullopt;
}

// Times are shown in UTC, since the person and the operator may live in different zones.
std::string utc_text(std::int64_t time_s) {
  const std::time_t time = time_s;
  std::tm parts{};
  std::array<char, 32> text{};
  gmtime_r(&time, &parts);
  return {text.data(), std::strftime(text.data(), text.size(), "%Y-%m-%d %H:%M UTC", &parts)};
}

std::string room_text(std::string_view room) {
  return wire::room_of(room) == wire::kLobby ? "the lobby" : "room '" + std::string(room) + "'";
}

}  // namespace

std::string_view to_string(TokenRefusal refusal) {
  switch (refusal) {
    case TokenRefusal::malformed:
      return "malformed";
    case TokenRefusal::bad_signature:
      return "bad_signature";
    case TokenRefusal::expired:
      return "expired";
    case TokenRefusal::not_yet:
      return "not_yet";
    case TokenRefusal::wrong_audience:
      return "wrong_audience";
    case TokenRefusal::wrong_room:
      return "wrong_room";
  }
  return "unknown";
}

std::string explain(TokenRefusal refusal, std::string_view token, const TokenKey& key, std::string_view room) {
  constexpr const char* kAskForNew = "; ask the operator of the server for a new one";
  // An empty token has no claims to explain; the person most likely does not know that one is needed.
  if (token.empty())
    return "this room needs a token; ask the operator of the server for one, and give it with --token, or as ?token= "
           "in "
           "the page's address";
  // The claims are read only if the signature is valid: an unsigned token gets no explanation in its own words.
  const auto claims = read_claims(token, key);
  switch (refusal) {
    case TokenRefusal::malformed:
      return open_jwt(token, key)
                 ? "the token's claims are not those that hairnet-token make writes: at least 'role' and 'exp' in "
                   "seconds"
                 : "this is not a token: hairnet-token make prints three words joined by dots; copy the whole line";
    case TokenRefusal::bad_signature:
      return std::string("the token is damaged, or was not made with the key of this server") + kAskForNew;
    case TokenRefusal::expired:
      return "the token has expired" + (claims ? ", on " + utc_text(claims->expires_s) : "") + kAskForNew;
    case TokenRefusal::not_yet:
      return "the token is not valid yet, but from " +
             (claims && claims->not_before_s ? utc_text(*claims->not_before_s) : "later") + " on; come back then";
    case TokenRefusal::wrong_audience:
      return std::string("the token was made for another service: its claim 'aud' does not name hairnet") + kAskForNew;
    case TokenRefusal::wrong_room:
      return "the token is for " + (claims && claims->room ? room_text(*claims->room) : "another room") +
             ", and not for " + room_text(room) +
             "; join that room, or ask the operator of the server for a token of this one";
  }
  return "the token is refused";
}

std::string validate(const TokenClaims& claims) {
  const auto is_time = [](std::int64_t t) { return t >= 0 && t <= kTokenTimeMax_s; };
  if (claims.room && !wire::is_room_name(*claims.room)) return wire::kRoomNameRule;
  if (!is_time(claims.expires_s) || !is_time(claims.not_before_s.value_or(0))) return "a time is not in 1970 to 9999";
  // Such a token could never be used.
  if (claims.not_before_s && *claims.not_before_s >= claims.expires_s) return "it expires before it is good";
  if (claims.strands_max.value_or(0) > static_cast<std::uint64_t>(kStrandsMax)) return "strands_max is too large";
  if (!is_name(claims.name) || !is_name(claims.subject) || !is_name(claims.id))
    return "a name, subject or id is up to 256 bytes, without control characters";
  return {};
}

std::string sign(const TokenClaims& claims, const TokenKey& key) {
  HAIRNET_ASSERT(validate(claims).empty());
  HAIRNET_ASSERT(!key.empty());
  nlohmann::ordered_json json;
  if (claims.room) json["room"] = *claims.room;
  json["role"] = to_string(claims.role);
  json["exp"] = claims.expires_s;
  if (claims.not_before_s) json["nbf"] = *claims.not_before_s;
  if (claims.characters_max) json["characters_max"] = *claims.characters_max;
  if (claims.strands_max) json["strands_max"] = *claims.strands_max;
  if (!claims.name.empty()) json["name"] = claims.name;
  if (!claims.subject.empty()) json["sub"] = claims.subject;
  if (!claims.id.empty()) json["jti"] = claims.id;
  if (claims.upload) json["upload"] = *claims.upload;
  if (claims.wind) json["wind"] = *claims.wind;
  if (claims.touch) json["touch"] = *claims.touch;
  if (claims.props) json["props"] = *claims.props;
  // Claims with their default are left out, so that tokens stay short.
  if (claims.moderate) json["moderate"] = true;
  // ASCII output keeps the text the same for every reader of JSON. The handler drops bytes that are not UTF-8, where
  // the default would throw.
  std::string token = sign_jwt(json.dump(-1, ' ', true, nlohmann::json::error_handler_t::ignore), key);
  HAIRNET_ASSERT(!token.empty());
  // A Hello carries at most so many bytes. The bounds of names in validate() keep every token below it.
  HAIRNET_ASSERT(token.size() <= wire::kTokenBytesMax);
  return token;
}

tl::expected<TokenClaims, TokenRefusal> read_claims(std::string_view token, const TokenKey& key) {
  const tl::expected<std::string, JwtRefusal> payload = open_jwt(token, key);
  if (!payload)
    return tl::unexpected(payload.error() == JwtRefusal::bad_signature ? TokenRefusal::bad_signature
                                                                       : TokenRefusal::malformed);
  const std::optional<FlatJson> json = parse_flat_json(*payload);
  if (!json) return tl::unexpected(TokenRefusal::malformed);
  ClaimReader reader(*json);
  // The audience is judged before other claims, which may be missing in a token of another service: "malformed" would
  // mislead its owner.
  if (!reader.for_us()) return tl::unexpected(TokenRefusal::wrong_audience);
  TokenClaims claims;
  claims.room = reader.text("room");
  const std::optional<wire::Role> role = role_of(reader.text("role"));
  const std::optional<std::int64_t> expires_s = reader.time_s("exp", false);
  claims.not_before_s = reader.time_s("nbf", true);
  if (const auto most = reader.whole("characters_max", kCharactersMax))
    claims.characters_max = static_cast<std::uint32_t>(*most);
  if (const auto most = reader.whole("strands_max", kStrandsMax))
    claims.strands_max = static_cast<std::uint64_t>(*most);
  claims.name = reader.text("name").value_or("");
  claims.subject = reader.text("sub").value_or("");
  claims.id = reader.text("jti").value_or("");
  claims.upload = reader.boolean("upload");
  claims.wind = reader.boolean("wind");
  claims.touch = reader.boolean("touch");
  claims.props = reader.boolean("props");
  claims.moderate = reader.boolean("moderate").value_or(false);
  // These two are required: a token without an end would be valid forever.
  if (!role || !expires_s) return tl::unexpected(TokenRefusal::malformed);
  if (!reader.valid() || (claims.room && !wire::is_room_name(*claims.room)) || !is_name(claims.name) ||
      !is_name(claims.subject) || !is_name(claims.id))
    return tl::unexpected(TokenRefusal::malformed);
  claims.role = *role;
  claims.expires_s = *expires_s;
  return claims;
}

tl::expected<TokenClaims, TokenRefusal> verify(std::string_view token, const TokenKey& key, std::int64_t now_s,
                                               std::string_view room) {
  tl::expected<TokenClaims, TokenRefusal> claims = read_claims(token, key);
  if (!claims) return claims;
  // The times and the room are judged only after the signature, so that a stranger learns nothing from the answer.
  if (now_s >= claims->expires_s) return tl::unexpected(TokenRefusal::expired);
  if (claims->not_before_s && now_s < *claims->not_before_s) return tl::unexpected(TokenRefusal::not_yet);
  if (claims->room && wire::room_of(*claims->room) != wire::room_of(room))
    return tl::unexpected(TokenRefusal::wrong_room);
  return claims;
}

}  // namespace hairnet::channel
