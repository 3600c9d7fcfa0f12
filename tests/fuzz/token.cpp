#include "schema/channel/token.hpp"

#include "tests/fuzz/target.hpp"

// Any text is refused as a token, or is a token that has the same claims when it is signed again. The same is true for
// any payload that the right key has signed. The first byte says which of the two follows.
int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace hairnet;
  static const channel::TokenKey key(std::vector<std::uint8_t>(channel::kTokenKeyBytesMin, 7));
  constexpr std::int64_t kNow_s = 1'800'000'000;
  constexpr std::string_view kRoom = "hall";
  if (size == 0) return 0;
  const std::string text(reinterpret_cast<const char*>(data) + 1, size - 1);
  const channel::TokenKey parsed = channel::TokenKey::parse(text);
  fuzz::require(parsed.empty() || channel::TokenKey::parse(parsed.to_text()).bytes() == parsed.bytes(), "the same key");

  const std::string token = data[0] % 2 == 0 ? text : channel::sign_jwt(text, key);
  const auto claims = channel::verify(token, key, kNow_s, kRoom);
  if (!claims) return 0;
  fuzz::require(claims->expires_s > kNow_s && claims->not_before_s.value_or(0) <= kNow_s, "good now");
  fuzz::require(!claims->room || *claims->room == kRoom, "good here");
  fuzz::require(channel::validate(*claims).empty(), "valid: " + channel::validate(*claims));
  const auto again = channel::verify(channel::sign(*claims, key), key, kNow_s, kRoom);
  fuzz::require(again && *again == *claims, "the same claims again");
  return 0;
}
