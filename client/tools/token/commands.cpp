#include "client/tools/token/commands.hpp"

#include <ctime>
#include <nlohmann/json.hpp>
#include <utility>

#include "client/files/read_file.hpp"

namespace hairnet::token {
namespace {

// A key is short: a larger file is another file.
constexpr std::size_t kKeyFileBytesMax = 4096;

Result<channel::TokenKey> read_key(const std::string& path) {
  const auto bytes = read_file(path, kKeyFileBytesMax);
  if (!bytes) return Refusal(path + ": " + bytes.error());
  channel::TokenKey key = channel::TokenKey::parse(as_text(*bytes));
  if (key.empty()) return Refusal(path + ": is no key; 'hairnet-token key' makes one");
  return key;
}

std::string utc(std::int64_t time_s) {
  const std::time_t time = time_s;
  std::tm parts{};
  char text[32] = "";
  if (gmtime_r(&time, &parts)) std::strftime(text, sizeof text, "%Y-%m-%dT%H:%M:%SZ", &parts);
  return text;
}

std::string state(const channel::TokenClaims& claims, std::int64_t now_s) {
  if (now_s >= claims.expires_s) return "expired";
  if (claims.not_before_s && now_s < *claims.not_before_s) return "not yet good";
  return "good";
}

}  // namespace

Result<std::string> make_key() {
  // Without randomness there must be no key: one that can be guessed would let anyone in.
  const channel::TokenKey key = channel::TokenKey::make_random();
  if (key.empty()) return Refusal("the system has no randomness");
  return key.to_text();
}

Result<std::string> make_token(const MakeOptions& options, std::int64_t now_s) {
  const Result<channel::TokenKey> key = read_key(options.key_file);
  if (!key) return Refusal(key.error());
  channel::TokenClaims claims = options.claims;
  // The options have durations from now; a token stores times.
  claims.expires_s = now_s + options.expires_s;
  if (options.not_before_s) claims.not_before_s = now_s + *options.not_before_s;
  // What the server would refuse must not be signed.
  if (std::string wrong = validate(claims); !wrong.empty()) return Refusal(std::move(wrong));
  std::string token = sign(claims, *key);
  // A text that is not UTF-8 does not survive in JSON: the token would say something else than was asked for.
  if (read_claims(token, *key) != claims) return Refusal("the name, subject or id is not valid UTF-8");
  return token;
}

Result<std::string> show_token(const ShowOptions& options, std::int64_t now_s) {
  const Result<channel::TokenKey> key = read_key(options.key_file);
  if (!key) return Refusal(key.error());
  // The signature is checked, so what is shown was granted by this key. Times are not: an expired token should be
  // shown, too.
  const auto claims = read_claims(options.token, *key);
  if (!claims) return Refusal(explain(claims.error(), options.token, *key, ""));
  nlohmann::ordered_json json;
  json["state"] = state(*claims, now_s);
  // Null means every room; the empty text is the lobby.
  json["room"] = claims->room ? nlohmann::ordered_json(*claims->room) : nlohmann::ordered_json(nullptr);
  json["role"] = to_string(claims->role);
  json["expires"] = utc(claims->expires_s);
  // Rights that the token leaves to the server are left out.
  if (claims->not_before_s) json["not_before"] = utc(*claims->not_before_s);
  if (claims->characters_max) json["characters_max"] = *claims->characters_max;
  if (claims->strands_max) json["strands_max"] = *claims->strands_max;
  if (!claims->name.empty()) json["name"] = claims->name;
  if (!claims->subject.empty()) json["subject"] = claims->subject;
  if (!claims->id.empty()) json["id"] = claims->id;
  if (claims->upload) json["upload"] = *claims->upload;
  if (claims->wind) json["wind"] = *claims->wind;
  if (claims->touch) json["touch"] = *claims->touch;
  if (claims->props) json["props"] = *claims->props;
  if (claims->moderate) json["moderate"] = true;
  return json.dump(2);
}

}  // namespace hairnet::token
