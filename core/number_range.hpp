#pragma once

#include <cmath>
#include <cstdio>
#include <span>
#include <string>
#include <string_view>

namespace hairnet {

// What a number from outside may be: in [least, most]. A number that is almost 0 is neither nothing nor of any use: its
// products with others leave the normal numbers of a float, where processors are slow and quotients overflow. So 0 is
// taken where the range has it, and otherwise no number below `smallest`.
struct NumberRange {
  static constexpr double kSmallest = 1e-12;

  // The name of the value with its unit.
  std::string_view name;
  double value = 0, least = 0, most = 0;
  double smallest = kSmallest;

  // Written so that NaN fails.
  [[nodiscard]] bool holds() const {
    return value >= least && value <= most && (value == 0 || std::abs(value) >= smallest);
  }
};

// Empty when all numbers are in their ranges; else one line about the first that is not.
inline std::string out_of_range(std::span<const NumberRange> ranges) {
  for (const NumberRange& range : ranges) {
    if (range.holds()) continue;
    const auto shown = [](double number) {
      char text[32];
      std::snprintf(text, sizeof text, "%.6g", number);
      return std::string(text);
    };
    const bool has_zero = range.least == 0;
    return std::string(range.name) + " is " + shown(range.value) + ", not " + (has_zero ? "0 or " : "") + "in [" +
           shown(has_zero ? range.smallest : range.least) + ", " + shown(range.most) + ']';
  }
  return {};
}

}  // namespace hairnet
