#pragma once

#include <cstdint>
#include <span>
#include <string>

namespace hairnet::server {

// A hash as the value of a log field: its first 8 hexadecimal digits.
inline std::string log_hash(std::span<const std::uint8_t, 32> hash) {
  constexpr char kDigits[] = "0123456789abcdef";
  std::string out;
  for (const std::uint8_t byte : hash.first<4>()) {
    out += kDigits[byte >> 4];
    out += kDigits[byte & 15];
  }
  return out;
}

}  // namespace hairnet::server
