#include "server/telemetry/log_text.hpp"

#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstdint>

namespace hairnet::server {
namespace {

constexpr std::size_t kTextBytesMax = 200;

struct Character {
  std::uint32_t code = 0;
  std::size_t bytes = 0;  // 0: the text does not begin with UTF-8
};

Character first_character(std::string_view text) {
  constexpr std::uint32_t kCodeMin[5] = {0, 0, 0x80, 0x800, 0x10000};  // a smaller code has a shorter form
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
  if (code < kCodeMin[bytes] || code > 0x10ffff || is_surrogate) return {};
  return {code, bytes};
}

bool is_hidden(std::uint32_t code) {
  return (code >= 0x80 && code < 0xa0)          // controls
         || code == 0x61c                       // Arabic letter mark
         || code == 0x200e || code == 0x200f    // marks of direction
         || (code >= 0x2028 && code <= 0x202e)  // separators of lines and paragraphs, embeddings and overrides
         || (code >= 0x2066 && code <= 0x2069)  // isolates
         || code == 0xfeff;                     // byte order mark
}

void add_escaped(std::string& out, char kind, int digit_count, std::uint32_t value) {
  out.append({'\\', kind});
  for (int i = digit_count - 1; i >= 0; --i) out += "0123456789abcdef"[value >> (4 * i) & 0xf];
}

}  // namespace

std::string log_text(std::string_view text) {
  std::size_t cut = std::min(text.size(), kTextBytesMax);
  while (cut < text.size() && cut > kTextBytesMax - 4 && (text[cut] & 0xc0) == 0x80) --cut;  // between two characters
  text = text.substr(0, cut);
  std::string out = "\"";
  while (!text.empty()) {
    const auto [code, bytes] = first_character(text);
    if (bytes == 0)
      add_escaped(out, 'x', 2, static_cast<std::uint8_t>(text.front()));
    else if (is_hidden(code))
      add_escaped(out, 'u', 4, code);
    else if (code < 0x20 || code == 0x7f)
      out += '?';
    else if (code == '"' || code == '\\')
      out.append({'\\', text.front()});
    else
      out += text.substr(0, bytes);
    text.remove_prefix(bytes == 0 ? 1 : bytes);
  }
  return out + '"';
}

}  // namespace hairnet::server
