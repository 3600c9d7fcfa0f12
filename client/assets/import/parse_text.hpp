#pragma once

#include <algorithm>
#include <charconv>
#include <cmath>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <string_view>

namespace hairnet {

// The same bytes as characters, for text formats.
inline std::string_view as_text(std::span<const std::byte> bytes) {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

// Parses the whole of `text` as a decimal number with or without a point and an exponent; a leading + is allowed. None
// for anything else, and for what exceeds a double. Up to 15 digits are rounded correctly; more digits are within 2
// units of the last place. The C++ library for WebAssembly has no std::from_chars for such numbers. Files of one groom
// must give the same bits in every program, so this function replaces std::from_chars everywhere.
inline std::optional<double> parse_decimal(std::string_view text) {
  const auto take = [&](char c) {
    const bool is_next = text.starts_with(c);
    if (is_next) text.remove_prefix(1);
    return is_next;
  };
  const bool is_negative = take('-');
  if (!is_negative) take('+');
  // As many digits as fit go into the mantissa. Later ones only shift the exponent, which is why the last place may
  // differ.
  constexpr std::uint64_t kFullMantissa = (std::numeric_limits<std::uint64_t>::max() - 9) / 10;
  std::uint64_t mantissa = 0;
  std::int64_t exponent = 0;
  bool has_digits = false;
  const auto take_digits = [&](int step_kept, int step_dropped) {
    for (; !text.empty() && text.front() >= '0' && text.front() <= '9'; text.remove_prefix(1)) {
      has_digits = true;
      const bool is_kept = mantissa <= kFullMantissa;
      if (is_kept) mantissa = 10 * mantissa + static_cast<std::uint64_t>(text.front() - '0');
      exponent += is_kept ? step_kept : step_dropped;
    }
  };
  take_digits(0, 1);
  if (take('.')) take_digits(-1, 0);
  if (!has_digits) return {};
  if (take('e') || take('E')) {
    const bool is_small = take('-');
    if (!is_small) take('+');
    if (text.empty()) return {};
    std::int64_t power = 0;
    // The bound keeps an exponent of any length from overflowing; it is far beyond a double in both directions.
    for (; !text.empty() && text.front() >= '0' && text.front() <= '9'; text.remove_prefix(1))
      power = std::min<std::int64_t>(10 * power + (text.front() - '0'), 100'000);
    exponent += is_small ? -power : power;
  }
  if (!text.empty()) return {};
  auto value = static_cast<double>(mantissa);
  // 10^22 is the largest power of ten that a double holds exactly, so each step rounds once.
  constexpr std::int64_t kExactPower = 22;
  while (value != 0 && exponent != 0) {
    const auto step = std::clamp<std::int64_t>(exponent, -kExactPower, kExactPower);
    const double power = std::pow(10.0, static_cast<double>(std::abs(step)));
    value = step < 0 ? value / power : value * power;
    exponent -= step;
    if (!std::isfinite(value)) return {};
  }
  return is_negative ? -value : value;
}

// Parses the whole of `text` as one number; a leading + is allowed. None for anything else, and for overflow, nan and
// inf. Whole numbers have no point or exponent.
template <class Number>
requires std::integral<Number> || std::floating_point<Number> std::optional<Number> parse_number(
    std::string_view text) {
  if constexpr (std::floating_point<Number>) {
    const std::optional<double> value = parse_decimal(text);
    if (!value || !std::isfinite(static_cast<Number>(*value))) return {};
    return static_cast<Number>(*value);
  } else {
    if (text.starts_with('+')) text.remove_prefix(1);
    if (text.starts_with('+')) return {};
    Number value{};
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (error != std::errc{} || end != text.data() + text.size()) return {};
    return value;
  }
}

// "1 curve", "2 curves", "2 meshes"
inline std::string counted(std::size_t count, std::string_view what) {
  return std::to_string(count).append(" ").append(what).append(count == 1 ? "" : what.ends_with("sh") ? "es" : "s");
}

inline constexpr std::string_view kBlanks = " \t\r\v\f";

// Takes the next word off the front of `text`; empty when there is none. A carriage return counts as a blank, so files
// of Windows need no care.
inline std::string_view take_word(std::string_view& text) {
  const std::size_t begin = text.find_first_not_of(kBlanks);
  if (begin == std::string_view::npos) {
    text = {};
    return {};
  }
  const std::size_t end = text.find_first_of(kBlanks, begin);
  const std::string_view word = text.substr(begin, end - begin);
  text = end == std::string_view::npos ? std::string_view{} : text.substr(end);
  return word;
}

// Takes the next line off the front of `text`, without its end. The last line needs no end.
inline std::string_view take_line(std::string_view& text) {
  const std::size_t end = text.find('\n');
  const std::string_view line = text.substr(0, end);
  text = end == std::string_view::npos ? std::string_view{} : text.substr(end + 1);
  return line;
}

}  // namespace hairnet
