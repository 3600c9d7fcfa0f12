#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <tl/expected.hpp>
#include <vector>

namespace hairnet::channel {

// RFC 7518, section 3.2, asks for a key that is no shorter than the hash.
inline constexpr std::size_t kTokenKeyBytesMin = 32;
inline constexpr std::size_t kTokenKeyBytesMax = 256;

// A secret key that signs and verifies tokens. The destructor wipes it from memory.
class TokenKey {
 public:
  // Takes kTokenKeyBytesMin to kTokenKeyBytesMax bytes; with any other size the key is empty, and signs and verifies
  // nothing.
  explicit TokenKey(std::vector<std::uint8_t> bytes);
  TokenKey(const TokenKey&) = delete;
  TokenKey& operator=(const TokenKey&) = delete;
  TokenKey(TokenKey&&) = default;
  TokenKey& operator=(TokenKey&&) = delete;
  ~TokenKey();

  // Draws a new key of kTokenKeyBytesMin bytes. It is empty where the system has no randomness to give.
  static TokenKey make_random();
  // Parses a key file's text: base64url without padding, and white space after it. Any other text gives an empty key.
  static TokenKey parse(std::string_view text);
  // Returns what parse() reads, without a line break. It is secret.
  [[nodiscard]] std::string to_text() const;

  [[nodiscard]] bool empty() const { return bytes_.empty(); }
  [[nodiscard]] const std::vector<std::uint8_t>& bytes() const { return bytes_; }

 private:
  std::vector<std::uint8_t> bytes_;
};

// `malformed`: the text is no token of this form. `bad_signature`: it is one, but is not signed with this key.
enum class JwtRefusal : std::uint8_t { malformed, bad_signature };

// Verifies a JSON Web Token (RFC 7519) signed with HMAC-SHA256 (HS256 of RFC 7518) in compact form and returns the
// payload as JSON text. Compares signatures in constant time. Refused as malformed: any other algorithm (also `none`),
// a `crit` extension, and a header field that appears twice.
tl::expected<std::string, JwtRefusal> open_jwt(std::string_view token, const TokenKey& key);
// Returns an empty string for an empty key.
std::string sign_jwt(std::string_view payload_json, const TokenKey& key);

}  // namespace hairnet::channel
