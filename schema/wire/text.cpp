#include "schema/wire/text.hpp"

#include <algorithm>
#include <cstddef>
#include <cstdint>

#include "core/assert.hpp"
#include "schema/wire/messages.hpp"

namespace hairnet::wire {
namespace {

struct LeadByte {
  std::size_t length;            // of the character, bytes; 0 = no character starts so
  std::uint32_t bits;            // of the code point
  std::uint32_t code_point_min;  // a smaller code point has a shorter form
};

LeadByte lead(unsigned char byte) {
  if (byte < 0x80) return {1, byte, 0};
  if ((byte & 0xE0) == 0xC0) return {2, byte & 0x1Fu, 0x80};
  if ((byte & 0xF0) == 0xE0) return {3, byte & 0x0Fu, 0x800};
  if ((byte & 0xF8) == 0xF0) return {4, byte & 0x07u, 0x10000};
  return {0, 0, 0};
}

bool is_allowed(std::uint32_t code) {
  const bool control = code < 0x20 || (code >= 0x7F && code < 0xA0);
  const bool surrogate = code >= 0xD800 && code < 0xE000;
  return !control && !surrogate && code <= 0x10FFFF;
}

// Bytes of the allowed character that `text` starts with; 0 when it starts with none.
std::size_t character_bytes(std::string_view text) {
  HAIRNET_ASSERT(!text.empty());
  const LeadByte first = lead(static_cast<unsigned char>(text.front()));
  if (first.length == 0 || first.length > text.size()) return 0;
  std::uint32_t code = first.bits;
  for (std::size_t i = 1; i < first.length; ++i) {
    const auto byte = static_cast<unsigned char>(text[i]);
    if ((byte & 0xC0) != 0x80) return 0;
    code = code << 6 | (byte & 0x3Fu);
  }
  return code >= first.code_point_min && is_allowed(code) ? first.length : 0;
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
    text.remove_prefix(std::max<std::size_t>(bytes, 1));
  }
  HAIRNET_VALIDATE(is_text(fitted));
  return fitted;
}

}  // namespace hairnet::wire
