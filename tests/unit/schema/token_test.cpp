#include "schema/channel/token.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdint>
#include <ostream>
#include <random>

#include "schema/channel/flat_json.hpp"
#include "schema/limits.hpp"

namespace hairnet::channel {

// For messages of tests.
static void PrintTo(const TokenClaims& claims, std::ostream* out) {
  *out << claims.name << " in " << claims.room.value_or("any room") << " until " << claims.expires_s;
}

namespace {

// The key and the signed token are the example of RFC 7515, appendix A.1; the unsigned token is that of RFC 7519,
// section 6.1.
constexpr const char* kRfcKey =
    "AyM1SysPpbyDfgZld3umj1qzKObwVMkoqQ-EstJQLr_T-1qS0gZH75aKtMN3Yj0iPS4hcgUuTwjAzZr1Z9CAow";
constexpr const char* kRfcToken =
    "eyJ0eXAiOiJKV1QiLA0KICJhbGciOiJIUzI1NiJ9."
    "eyJpc3MiOiJqb2UiLA0KICJleHAiOjEzMDA4MTkzODAsDQogImh0dHA6Ly9leGFtcGxlLmNvbS9pc19yb290Ijp0cnVlfQ."
    "dBjftJeZ4CVP-mB92K27uhbUJU1p1r_wW1gFWFOEjXk";
constexpr const char* kRfcPayload =
    "{\"iss\":\"joe\",\r\n \"exp\":1300819380,\r\n \"http://example.com/is_root\":true}";
constexpr const char* kRfcUnsigned =
    "eyJhbGciOiJub25lIn0."
    "eyJpc3MiOiJqb2UiLA0KICJleHAiOjEzMDA4MTkzODAsDQogImh0dHA6Ly9leGFtcGxlLmNvbS9pc19yb290Ijp0cnVlfQ.";

// This is 2023-11-14 22:13:20 UTC, which the messages below show.
constexpr std::int64_t kNow_s = 1'700'000'000;

TokenKey rfc_key() {
  return TokenKey::parse(kRfcKey);
}
TokenKey key_of(std::uint8_t byte) {
  return TokenKey(std::vector<std::uint8_t>(kTokenKeyBytesMin, byte));
}

TokenClaims full_claims() {
  TokenClaims claims;
  claims.room = "stage.2";
  claims.role = wire::Role::observer;
  claims.expires_s = kNow_s + 60;
  claims.not_before_s = kNow_s - 60;
  claims.characters_max = 3;
  claims.strands_max = 200'000;
  claims.name = "Zoë \"Z\"";
  claims.subject = "users/zoë";
  claims.id = "7f-3";
  claims.upload = true;
  claims.wind = false;
  claims.touch = true;
  claims.props = false;
  claims.moderate = true;
  return claims;
}

// Returns a token with this text as payload, signed as it should be, so that only its claims can be wrong.
std::string with_payload(const std::string& json) {
  return sign_jwt(json, rfc_key());
}

std::string refusal(const tl::expected<TokenClaims, TokenRefusal>& verified) {
  return verified ? "taken" : std::string(to_string(verified.error()));
}
std::string refusal_of_payload(const std::string& json) {
  return refusal(verify(with_payload(json), rfc_key(), kNow_s, "stage"));
}

// Returns the base64url of a text, cut out of a token that has it as payload.
std::string base64(std::string text) {
  const std::string token = sign_jwt(text, rfc_key());
  const std::size_t first = token.find('.');
  return token.substr(first + 1, token.find('.', first + 1) - first - 1);
}

TEST(Jwt, opens_the_example_of_the_rfc) {
  const auto payload = open_jwt(kRfcToken, rfc_key());
  ASSERT_TRUE(payload);
  EXPECT_EQ(*payload, kRfcPayload);
}

// An attacker who may choose the algorithm needs no key ("none") or another kind of key. Each header but that of HS256
// must be refused.
TEST(Jwt, refuses_the_unsigned_example_of_the_rfc_and_every_other_algorithm) {
  EXPECT_EQ(open_jwt(kRfcUnsigned, rfc_key()).error(), JwtRefusal::malformed);
  const std::string token = kRfcToken, rest = token.substr(token.find('.'));
  for (const char* header : {R"({"alg":"none"})", R"({"alg":"HS512"})", R"({"alg":"hs256"})", R"({"alg":256})", R"({})",
                             R"({"alg":"none","alg":"HS256"})", R"({"alg":"HS256","crit":["exp"]})",
                             R"({"alg":"HS256","typ":"JOSE"})", R"(["HS256"])", "", "{"}) {
    const auto opened = open_jwt(base64(header) + rest, rfc_key());
    ASSERT_FALSE(opened) << header;
    EXPECT_EQ(opened.error(), JwtRefusal::malformed) << header;
  }
}

TEST(Jwt, refuses_every_truncation_and_every_changed_character_of_the_example) {
  const std::string token = kRfcToken;
  for (std::size_t size = 0; size < token.size(); ++size)
    EXPECT_FALSE(open_jwt(token.substr(0, size), rfc_key())) << size;
  for (std::size_t i = 0; i < token.size(); ++i) {
    for (const char c : {'A', '.', '=', '\0', '+'}) {
      std::string changed = token;
      if (changed[i] == c) continue;
      changed[i] = c;
      EXPECT_FALSE(open_jwt(changed, rfc_key())) << i << c;
    }
  }
  for (const char* more : {".", "A", "=", " ", "\n"}) EXPECT_FALSE(open_jwt(token + more, rfc_key())) << more;
}

TEST(Jwt, takes_one_way_only_to_write_the_bytes) {
  // 32 bytes are 43 characters, and the last one has two unused bits: 'k' is 36, so 'l', 'm' and 'n' mean the same.
  std::string token = kRfcToken;
  for (const char c : {'l', 'm', 'n'}) {
    token.back() = c;
    EXPECT_EQ(open_jwt(token, rfc_key()).error(), JwtRefusal::malformed) << c;
  }
}

TEST(Jwt, refuses_another_key_and_no_key) {
  EXPECT_EQ(open_jwt(kRfcToken, key_of(1)).error(), JwtRefusal::bad_signature);
  EXPECT_EQ(open_jwt(kRfcToken, TokenKey({})).error(), JwtRefusal::bad_signature);
  EXPECT_EQ(sign_jwt("{}", TokenKey({})), "");
}

TEST(Jwt, refuses_more_than_4_KB_with_any_signature) {
  std::string json = R"({"x":")";
  json.resize(wire::kTokenBytesMax, 'x');
  json += "\"}";
  EXPECT_EQ(open_jwt(with_payload(json), rfc_key()).error(), JwtRefusal::malformed);
}

TEST(Jwt, never_opens_random_text) {
  std::mt19937 random(7);  // NOLINT: the same texts every time
  const std::string letters = "abcXYZ019-_.={}\"\\ \n";
  for (int round = 0; round < 20'000; ++round) {
    std::string text(random() % 120, '.');
    for (char& c : text) c = random() % 8 == 0 ? static_cast<char>(random()) : letters[random() % letters.size()];
    EXPECT_FALSE(open_jwt(text, rfc_key()));
    parse_flat_json(text);
  }
}

TEST(TokenKey, a_key_survives_its_text_and_may_be_neither_short_nor_long) {
  const TokenKey key = TokenKey::make_random();
  ASSERT_EQ(key.bytes().size(), kTokenKeyBytesMin);
  EXPECT_EQ(TokenKey::parse(key.to_text() + "\n").bytes(), key.bytes());
  EXPECT_NE(TokenKey::make_random().bytes(), key.bytes());
  EXPECT_TRUE(TokenKey(std::vector<std::uint8_t>(kTokenKeyBytesMin - 1)).empty());
  EXPECT_TRUE(TokenKey(std::vector<std::uint8_t>(kTokenKeyBytesMax + 1)).empty());
  for (const char* text : {"", "short", "not base64 at all, but long enough to be a key of 32 bytes!"})
    EXPECT_TRUE(TokenKey::parse(text).empty()) << text;
}

TEST(Token, grants_what_was_signed) {
  const TokenClaims claims = full_claims();
  ASSERT_EQ(validate(claims), "");
  const auto verified = verify(sign(claims, rfc_key()), rfc_key(), kNow_s, "stage.2");
  ASSERT_TRUE(verified) << to_string(verified.error());
  EXPECT_EQ(*verified, claims);
}

TEST(TokenDeathTest, claims_that_are_not_valid_are_not_signed) {
  TokenClaims claims = full_claims();
  claims.name = "two\nlines";
  EXPECT_DEATH(sign(claims, rfc_key()), "assertion failed: validate\\(claims\\)");
  EXPECT_DEATH(sign(full_claims(), TokenKey({})), "assertion failed: !key.empty\\(\\)");
}

TEST(Token, fits_a_hello_with_the_longest_texts) {
  std::string longest, invalid(kTokenNameBytesMax, '\xff');
  // JSON escapes this letter to six bytes in the payload.
  while (longest.size() < kTokenNameBytesMax) longest += "ß";
  TokenClaims claims = full_claims();
  for (const std::string& text : {longest, invalid, std::string(kTokenNameBytesMax, '"')}) {
    claims.name = claims.subject = claims.id = text;
    ASSERT_EQ(validate(claims), "");
    EXPECT_LE(sign(claims, rfc_key()).size(), wire::kTokenBytesMax);
  }
}

TEST(Token, without_a_room_is_good_in_any_and_with_either_of_its_names_in_the_lobby) {
  TokenClaims claims = full_claims();
  claims.room.reset();
  for (const char* room : {"", "stage"})
    EXPECT_EQ(refusal(verify(sign(claims, rfc_key()), rfc_key(), kNow_s, room)), "taken");
  for (const char* lobby : {"", "lobby"}) {
    claims.room = lobby;
    EXPECT_EQ(refusal(verify(sign(claims, rfc_key()), rfc_key(), kNow_s, "")), "taken");
    EXPECT_EQ(refusal(verify(sign(claims, rfc_key()), rfc_key(), kNow_s, "lobby")), "taken");
    EXPECT_EQ(refusal(verify(sign(claims, rfc_key()), rfc_key(), kNow_s, "stage")), "wrong_room");
  }
}

// full_claims() is valid from 60 s before kNow_s up to 60 s after, without that second.
TEST(Token, is_good_from_its_first_second_up_to_its_last) {
  const std::string token = sign(full_claims(), rfc_key());
  const auto at = [&token](std::int64_t now_s) { return refusal(verify(token, rfc_key(), now_s, "stage.2")); };
  EXPECT_EQ(at(kNow_s - 61), "not_yet");
  EXPECT_EQ(at(kNow_s - 60), "taken");
  EXPECT_EQ(at(kNow_s + 59), "taken");
  EXPECT_EQ(at(kNow_s + 60), "expired");
  EXPECT_EQ(refusal(read_claims(token, rfc_key())), "taken");
}

TEST(Token, says_why_it_is_refused) {
  const std::string token = sign(full_claims(), rfc_key());
  EXPECT_EQ(refusal(verify(token, rfc_key(), kNow_s, "stage.3")), "wrong_room");
  EXPECT_EQ(refusal(verify(token, rfc_key(), kNow_s, "")), "wrong_room");
  EXPECT_EQ(refusal(verify(token, key_of(1), kNow_s, "stage.2")), "bad_signature");
  EXPECT_EQ(refusal(verify("", rfc_key(), kNow_s, "")), "malformed");
  EXPECT_EQ(refusal(verify(kRfcUnsigned, rfc_key(), 0, "")), "malformed");
  // The example of the RFC is well signed, but it has no role.
  EXPECT_EQ(refusal(verify(kRfcToken, rfc_key(), 0, "")), "malformed");
}

TEST(Token, explains_a_refusal_to_its_holder) {
  const std::string token = sign(full_claims(), rfc_key());
  const auto explained = [](const std::string& text, const TokenKey& key, std::int64_t now_s, std::string_view room) {
    const auto verified = verify(text, key, now_s, room);
    return verified ? "taken" : explain(verified.error(), text, key, room);
  };
  EXPECT_THAT(explained("", rfc_key(), kNow_s, ""), testing::StartsWith("this room needs a token; ask the operator"));
  EXPECT_THAT(explained("let me in", rfc_key(), kNow_s, ""), testing::StartsWith("this is not a token: "));
  EXPECT_THAT(explained(kRfcToken, rfc_key(), 0, ""), testing::StartsWith("the token's claims are not those"));
  EXPECT_THAT(explained(token, rfc_key(), kNow_s, "attic"),
              testing::StartsWith("the token is for room 'stage.2', and not for room 'attic'; "));
  EXPECT_THAT(explained(token, rfc_key(), kNow_s, ""), testing::HasSubstr("and not for the lobby; "));
  EXPECT_THAT(explained(token, rfc_key(), kNow_s + 60, "stage.2"),
              testing::HasSubstr("expired, on 2023-11-14 22:14 UTC"));
  EXPECT_THAT(explained(token, rfc_key(), kNow_s - 61, "stage.2"), testing::HasSubstr("from 2023-11-14 22:12 UTC on"));
  // Another key's token is data of a stranger: nothing of it is repeated.
  EXPECT_THAT(explained(token, key_of(1), kNow_s, "attic"),
              testing::AllOf(testing::StartsWith("the token is damaged"), testing::Not(testing::HasSubstr("stage.2"))));
}

TEST(Token, may_have_claims_of_others_and_whole_or_broken_times) {
  EXPECT_EQ(
      refusal_of_payload(R"({"iss":"joe","sub":"x","iat":1,"x":{"y":[1,{}]},"role":"observer","exp":1700000001})"),
      "taken");
  EXPECT_EQ(refusal_of_payload(R"({"role":"observer","exp":1700000000.9})"), "expired");
  EXPECT_EQ(refusal_of_payload(R"({"role":"observer","exp":1.8e9,"nbf":1699999999.5})"), "taken");
  EXPECT_EQ(refusal_of_payload(R"({"role":"observer","exp":1800000000,"nbf":1700000000.1})"), "not_yet");
}

TEST(Token, for_another_audience_is_refused) {
  const auto with = [](const std::string& aud) {
    return refusal_of_payload(R"({"role":"participant","exp":1800000000,"aud":)" + aud + "}");
  };
  EXPECT_EQ(with(R"("hairnet")"), "taken");
  EXPECT_EQ(with(R"(["other","hairnet"])"), "taken");
  EXPECT_EQ(with(R"("other")"), "wrong_audience");
  EXPECT_EQ(with(R"([])"), "wrong_audience");
  EXPECT_EQ(with(R"(["hairnet",1])"), "wrong_audience");
  EXPECT_EQ(with(R"([["hairnet"]])"), "wrong_audience");
  EXPECT_EQ(with("7"), "wrong_audience");
}

// Each line adds one wrong claim to a good payload. The limits are 2^32 - 1 characters, 10^12 strands, 8 levels of
// nesting (flat_json.cpp), and the end of the year 9999 (kTokenTimeMax_s) for times.
TEST(Token, a_signed_payload_that_is_not_in_order_is_malformed) {
  const std::string good = R"("role":"participant","exp":1800000000)";
  ASSERT_EQ(refusal_of_payload("{" + good + "}"), "taken");
  for (const char* more : {R"("role":"participant")",
                           R"("exp":1800000000)",
                           R"("room":"a b")",
                           R"("room":7)",
                           R"("room":null)",
                           R"("room":["stage"])",
                           R"("characters_max":-1)",
                           R"("characters_max":1.5)",
                           R"("characters_max":"3")",
                           R"("characters_max":4294967296)",
                           R"("strands_max":1000000000001)",
                           R"("strands_max":true)",
                           R"("nbf":"now")",
                           R"("nbf":-1)",
                           R"("nbf":1e300)",
                           R"("name":7)",
                           R"("name":"a\nb")",
                           R"("name":"\u0085")",
                           R"("name":"\ud800")",
                           "\"name\":\"\xff\"",
                           R"("sub":7)",
                           R"("sub":"a\nb")",
                           R"("jti":["a"])",
                           R"("upload":1)",
                           R"("wind":"on")",
                           R"("touch":1)",
                           R"("props":"off")",
                           R"("moderate":1)",
                           R"("x":1,"x":2)",
                           R"("x":1e999)",
                           R"("x":[[[[[[[[[]]]]]]]]])",
                           "",
                           R"("x")",
                           "7"}) {
    EXPECT_EQ(refusal_of_payload("{" + good + "," + more + "}"), "malformed") << more;
  }
  for (const char* json :
       {"", "{}", "[]", "7", "null", R"({"exp":1800000000})", R"({"role":"participant"})",
        R"({"role":"admin","exp":1800000000})", R"({"role":1,"exp":1800000000})", R"({"role":"observer","exp":"1"})",
        R"({"role":"observer","exp":-1})", R"({"role":"observer","exp":253402300800})",
        R"({"role":"observer","exp":18446744073709551615})", R"({"role":"observer","exp":1800000000} x)"})
    EXPECT_EQ(refusal_of_payload(json), "malformed") << json;
  // A room name has at most 64 bytes (kRoomNameBytesMax); the texts below have at most 256 (kTokenNameBytesMax).
  EXPECT_EQ(refusal_of_payload("{" + good + R"(,"room":")" + std::string(65, 'a') + "\"}"), "malformed");
  for (const char* claim : {"name", "sub", "jti"}) {
    EXPECT_EQ(refusal_of_payload("{" + good + ",\"" + claim + "\":\"" + std::string(256, 'a') + "\"}"), "taken");
    EXPECT_EQ(refusal_of_payload("{" + good + ",\"" + claim + "\":\"" + std::string(257, 'a') + "\"}"), "malformed");
  }
}

TEST(Token, every_truncation_of_a_payload_is_malformed) {
  const std::string json = R"({"room":"stage","role":"participant","exp":1800000000,"name":"x"})";
  ASSERT_EQ(refusal_of_payload(json), "taken");
  for (std::size_t size = 0; size < json.size(); ++size)
    EXPECT_EQ(refusal_of_payload(json.substr(0, size)), "malformed") << size;
}

TEST(Token, claims_that_make_no_sense_are_not_to_be_signed) {
  const auto error = [](auto change) {
    TokenClaims claims = full_claims();
    change(claims);
    return validate(claims);
  };
  EXPECT_NE(error([](TokenClaims& c) { c.room = "a/b"; }), "");
  EXPECT_NE(error([](TokenClaims& c) { c.expires_s = -1; }), "");
  EXPECT_NE(error([](TokenClaims& c) { c.not_before_s = c.expires_s; }), "");
  EXPECT_NE(error([](TokenClaims& c) { c.name = "a\tb"; }), "");
  EXPECT_NE(error([](TokenClaims& c) { c.subject = "a\tb"; }), "");
  EXPECT_NE(error([](TokenClaims& c) { c.id = std::string(257, 'a'); }), "");
  EXPECT_NE(error([](TokenClaims& c) { c.strands_max = ~std::uint64_t{0}; }), "");
}

}  // namespace
}  // namespace hairnet::channel
