#include "schema/channel/jwt.hpp"

#include <sodium.h>

#include <array>
#include <optional>
#include <utility>

#include "core/assert.hpp"
#include "schema/channel/flat_json.hpp"
#include "schema/limits.hpp"

namespace hairnet::channel {
namespace {

constexpr int kBase64 = sodium_base64_VARIANT_URLSAFE_NO_PADDING;
constexpr std::string_view kHeader = R"({"alg":"HS256","typ":"JWT"})";

using Mac = std::array<std::uint8_t, crypto_auth_hmacsha256_BYTES>;

Mac mac_of(std::string_view text, const TokenKey& key) {
  HAIRNET_ASSERT(!key.empty());
  Mac mac;
  crypto_auth_hmacsha256_state state;
  crypto_auth_hmacsha256_init(&state, key.bytes().data(), key.bytes().size());
  crypto_auth_hmacsha256_update(&state, reinterpret_cast<const unsigned char*>(text.data()), text.size());
  crypto_auth_hmacsha256_final(&state, mac.data());
  // The state holds values derived from the key, and would stay on the stack.
  sodium_memzero(&state, sizeof state);
  return mac;
}

std::string to_base64(const void* bytes, std::size_t count) {
  std::string text(sodium_base64_encoded_len(count, kBase64), '\0');
  sodium_bin2base64(text.data(), text.size(), static_cast<const unsigned char*>(bytes), count, kBase64);
  // The text ended with a zero.
  text.pop_back();
  return text;
}

// Accepts only the canonical form: no padding, white space or stray bits.
std::optional<std::vector<std::uint8_t>> from_base64(std::string_view text) {
  std::vector<std::uint8_t> bytes(text.size() / 4 * 3 + 3);
  std::size_t count = 0;
  const char* end = nullptr;
  if (sodium_base642bin(bytes.data(), bytes.size(), text.data(), text.size(), nullptr, &count, &end, kBase64) != 0 ||
      end != text.data() + text.size())
    return std::nullopt;
  HAIRNET_ASSERT(count <= bytes.size());
  bytes.resize(count);
  return bytes;
}

std::string to_string(const std::vector<std::uint8_t>& bytes) {
  return {bytes.begin(), bytes.end()};
}

// The algorithm is ours, not the token's choice: a header with `none` or a public-key algorithm would let anyone sign.
// A `crit` field names extensions that a reader must know or refuse (RFC 7515, 4.1.11), and this one knows none.
bool is_our_header(const std::string& json) {
  // The header is not yet authenticated here: it is parsed as untrusted text.
  const std::optional<FlatJson> header = parse_flat_json(json);
  if (!header || header->contains("crit")) return false;
  const auto text = [&header](const char* name) {
    const auto found = header->find(name);
    const std::string* value = found == header->end() ? nullptr : std::get_if<std::string>(&found->second);
    return value ? *value : std::string();
  };
  return text("alg") == "HS256" && (!header->contains("typ") || text("typ") == "JWT");
}

}  // namespace

TokenKey::TokenKey(std::vector<std::uint8_t> bytes) : bytes_(std::move(bytes)) {
  if (bytes_.size() >= kTokenKeyBytesMin && bytes_.size() <= kTokenKeyBytesMax) return;
  // A key of a wrong size is wiped too: it may be a real key that somebody has copied badly.
  sodium_memzero(bytes_.data(), bytes_.size());
  bytes_.clear();
}

TokenKey::~TokenKey() {
  sodium_memzero(bytes_.data(), bytes_.size());
}

TokenKey TokenKey::make_random() {
  std::vector<std::uint8_t> bytes;
  if (sodium_init() >= 0) {
    bytes.resize(kTokenKeyBytesMin);
    randombytes_buf(bytes.data(), bytes.size());
  }
  return TokenKey(std::move(bytes));
}

TokenKey TokenKey::parse(std::string_view text) {
  while (!text.empty() && (text.back() == '\n' || text.back() == '\r' || text.back() == ' ')) text.remove_suffix(1);
  return TokenKey(from_base64(text).value_or(std::vector<std::uint8_t>()));
}

std::string TokenKey::to_text() const {
  return to_base64(bytes_.data(), bytes_.size());
}

tl::expected<std::string, JwtRefusal> open_jwt(std::string_view token, const TokenKey& key) {
  const auto malformed = tl::unexpected(JwtRefusal::malformed);
  if (token.size() > wire::kTokenBytesMax) return malformed;
  const std::size_t first = token.find('.');
  const std::size_t second = first == std::string_view::npos ? first : token.find('.', first + 1);
  if (second == std::string_view::npos || token.find('.', second + 1) != std::string_view::npos) return malformed;
  const auto header = from_base64(token.substr(0, first));
  const auto payload = from_base64(token.substr(first + 1, second - first - 1));
  const auto signature = from_base64(token.substr(second + 1));
  if (!header || !payload || !signature || signature->size() != Mac().size() || !is_our_header(to_string(*header)))
    return malformed;
  if (key.empty()) return tl::unexpected(JwtRefusal::bad_signature);
  // The signature covers the text as it came, not what was decoded: there is no second encoding of a signed token.
  const Mac mac = mac_of(token.substr(0, second), key);
  // A comparison that stops at the first difference would tell by its time how many bytes of a forged signature are
  // right.
  if (sodium_memcmp(mac.data(), signature->data(), mac.size()) != 0) return tl::unexpected(JwtRefusal::bad_signature);
  return to_string(*payload);
}

std::string sign_jwt(std::string_view payload_json, const TokenKey& key) {
  if (key.empty()) return {};
  const std::string text =
      to_base64(kHeader.data(), kHeader.size()) + '.' + to_base64(payload_json.data(), payload_json.size());
  const Mac mac = mac_of(text, key);
  return text + '.' + to_base64(mac.data(), mac.size());
}

}  // namespace hairnet::channel
