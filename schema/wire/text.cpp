#include "schema/wire/text.hpp"

#include <algorithm>
#include <cstddef>

#include "core/assert.hpp"
#include "core/shown_text.hpp"
#include "schema/wire/messages.hpp"

namespace hairnet::wire {
namespace {

// Bytes of the allowed character that `text` starts with; 0 when it starts with none.
std::size_t character_bytes(std::string_view text) {
  HAIRNET_ASSERT(!text.empty());
  const auto [code, bytes] = first_character(text);
  const bool control = code < 0x20 || (code >= 0x7F && code < 0xA0);
  return control ? 0 : bytes;
}

}  // namespace

bool is_text(std::string_view text) {
  if (text.size() > kTextBytesMax) return false;
  while (!text.empty()) {
    const std::size_t bytes = character_bytes(text);
    if (bytes == 0) return false;
    text.remove_prefix(bytes);
  }
  return true;
}

std::string fit_text(std::string_view text) {
  std::string fitted;
  fitted.reserve(std::min(text.size(), kTextBytesMax));
  while (!text.empty()) {
    const std::size_t bytes = character_bytes(text);
    const std::string_view character = bytes == 0 ? "?" : text.substr(0, bytes);
    if (fitted.size() + character.size() > kTextBytesMax) break;
    fitted += character;
    // A byte that begins no character is passed over alone, since the next byte may begin one. A control character is
    // passed over as a whole.
    text.remove_prefix(std::max<std::size_t>(first_character(text).bytes, 1));
  }
  HAIRNET_VALIDATE(is_text(fitted));
  return fitted;
}

}  // namespace hairnet::wire
