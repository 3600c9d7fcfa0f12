#pragma once

#include <cstdint>
#include <cstdio>
#include <span>
#include <string>
#include <string_view>

namespace hairnet::same_bits {

// Collects what functions give, a line each. equal() writes a name, a count and a hash, which must be equal everywhere.
// near() writes "~", a bound, a name and the numbers themselves, which the sines and exponentials of a C library make a
// little different: compare.mjs allows them to differ by the bound.
class Results {
 public:
  // Begins each further line with the kind and the name of a case.
  void begin_case(std::string_view kind, std::string_view name) {
    case_ = std::string(kind) + " " + std::string(name) + ": ";
  }

  template <class Range>
  void equal(std::string_view what, const Range& values) {
    const std::span all(values);
    std::uint64_t hash = 0xcbf29ce484222325;  // FNV-1a
    for (const std::byte byte : std::as_bytes(all)) hash = (hash ^ static_cast<std::uint8_t>(byte)) * 0x100000001b3;
    char text[64];
    std::snprintf(text, sizeof text, " %zu %08lx%08lx\n", all.size(), static_cast<unsigned long>(hash >> 32),
                  static_cast<unsigned long>(hash & 0xffffffff));
    lines_ += case_ + std::string(what) + text;
  }
  void near(double bound, std::string_view what, std::span<const double> values) {
    char text[32];
    std::snprintf(text, sizeof text, "~%g ", bound);
    lines_ += text + case_ + std::string(what);
    for (const double value : values) {
      std::snprintf(text, sizeof text, " %.12g", value);
      lines_ += text;
    }
    lines_ += '\n';
  }
  [[nodiscard]] const std::string& lines() const { return lines_; }

 private:
  std::string case_, lines_;
};

}  // namespace hairnet::same_bits
