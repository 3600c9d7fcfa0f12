#pragma once

#include <string>
#include <string_view>

namespace hairnet::server {

// Text from outside as the value of a log field: in quotes, on one line, at most 200 bytes of it.
inline std::string log_text(std::string_view text) {
  std::string out = "\"";
  for (const char c : text.substr(0, 200)) {
    if (c == '"' || c == '\\') out += '\\';
    out += static_cast<unsigned char>(c) < 0x20 || c == 0x7f ? '?' : c;
  }
  return out + '"';
}

}  // namespace hairnet::server
