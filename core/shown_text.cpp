#include "core/shown_text.hpp"

#include <bit>

namespace hairnet {
namespace {

constexpr std::size_t kWordBytesMax = 40;

// Characters with which a stranger's text could forge a line of the log, hide what follows, or turn the direction of a
// terminal.
bool is_hidden(std::uint32_t code) {
  return code < 0x20 || (code >= 0x7f && code < 0xa0)  // controls
         || code == 0x61c                              // Arabic letter mark
         || code == 0x200e || code == 0x200f           // marks of direction
         || (code >= 0x2028 && code <= 0x202e)         // separators of lines and paragraphs, embeddings and overrides
         || (code >= 0x2066 && code <= 0x2069)         // isolates
         || code == 0xfeff;                            // byte order mark
}

void add_escaped(std::string& out, char kind, int digit_count, std::uint32_t value) {
  out.append({'\\', kind});
  for (int i = digit_count - 1; i >= 0; --i) out += "0123456789abcdef"[value >> (4 * i) & 0xf];
}

// The longest beginning of at most `bytes_max` bytes that cuts no character.
std::string_view beginning(std::string_view text, std::size_t bytes_max) {
  if (text.size() <= bytes_max) return text;
  std::size_t cut = bytes_max;
  // A character has at most four bytes. The search ends there, so that text that is no UTF-8 is cut as well.
  while (cut > 0 && cut + 4 > bytes_max && (text[cut] & 0xc0) == 0x80) --cut;
  return text.substr(0, cut);
}

}  // namespace

Utf8Character first_character(std::string_view text) {
  // A smaller code has a shorter form, so its longer one is not valid.
  constexpr std::uint32_t kCodeMin[5] = {0, 0, 0x80, 0x800, 0x10000};
  const auto lead = static_cast<std::uint8_t>(text.front());
  if (lead < 0x80) return {lead, 1};
  const auto bytes = static_cast<std::size_t>(std::countl_one(lead));
  if (bytes < 2 || bytes > 4 || bytes > text.size()) return {};
  std::uint32_t code = lead & (0x7fu >> bytes);
  for (const char c : text.substr(1, bytes - 1)) {
    if ((c & 0xc0) != 0x80) return {};
    code = code << 6 | (c & 0x3fu);
  }
  const bool is_surrogate = code >= 0xd800 && code < 0xe000;
  // An overlong form could smuggle a control character past a filter that looks at bytes.
  if (code < kCodeMin[bytes] || code > 0x10ffff || is_surrogate) return {};
  return {code, bytes};
}

std::string shown_text(std::string_view text, std::size_t bytes_max, char quote) {
  text = beginning(text, bytes_max);
  std::string out;
  while (!text.empty()) {
    const auto [code, bytes] = first_character(text);
    if (bytes == 0)
      add_escaped(out, 'x', 2, static_cast<std::uint8_t>(text.front()));
    else if (is_hidden(code))
      add_escaped(out, 'u', 4, code);
    else if (text.front() == '\\' || text.front() == quote)
      out.append({'\\', text.front()});
    else
      out += text.substr(0, bytes);
    text.remove_prefix(bytes == 0 ? 1 : bytes);
  }
  return out;
}

std::string shown(std::string_view word) {
  return shown_text(word, kWordBytesMax, '\'') + (word.size() > kWordBytesMax ? "..." : "");
}

}  // namespace hairnet
