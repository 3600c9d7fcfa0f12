#include "server/app/setting.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <type_traits>

#include "core/assert.hpp"

namespace hairnet::server {
namespace {

// The kinds of values in error messages, in the order of Setting::Kind.
constexpr std::array<const char*, 5> kKindNames{"a boolean", "an integer", "a number", "text", "three numbers"};

static_assert(kKindNames.size() == std::variant_size_v<Setting::Value>);

const char* kind_name(std::size_t kind) {
  HAIRNET_ASSERT(kind < kKindNames.size());
  return kKindNames[kind];
}

// Reads the whole word as a number. False when it is none.
template <class T>
bool parse(const std::string& word, T& value) {
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
  return error == std::errc() && end == word.data() + word.size();
}

bool parse_boolean(const std::string& word, bool& value) {
  value = word == "on" || word == "true";
  return value || word == "off" || word == "false";
}

// Whether the number is within the bounds. The condition is written so that NaN fails.
bool is_in(const Setting& s, double number) {
  return number >= s.number_min && number <= s.number_max;
}

std::string range(const Setting& s) {
  return s.kind() == Setting::Kind::integer ? fmt::format("{} to {}", s.integer_min, s.integer_max)
                                            : fmt::format("{} to {}", s.number_min, s.number_max);
}

std::string check_text(const Setting& s, const std::string& text) {
  if (text.empty() && !s.may_be_empty) return "must not be empty";
  // A control character in a path or an address would come up in logs and headers.
  if (std::any_of(text.begin(), text.end(), [](char c) { return static_cast<unsigned char>(c) < 0x20 || c == 0x7f; }))
    return "holds a control character";
  if (!s.choices.empty() && std::find(s.choices.begin(), s.choices.end(), text) == s.choices.end())
    return fmt::format("'{}' is none of {}", text, fmt::join(s.choices, ", "));
  return {};
}

}  // namespace

std::string check(const Setting& s, Setting::Value& value) {
  using Kind = Setting::Kind;
  HAIRNET_ASSERT(s.integer_min <= s.integer_max);
  HAIRNET_ASSERT(s.number_min <= s.number_max);
  const Kind kind = s.kind();
  // TOML makes an integer of "30"; a number may be written so.
  if (const auto* whole = std::get_if<std::int64_t>(&value); whole && kind == Kind::number)
    value = static_cast<double>(*whole);
  if (static_cast<Kind>(value.index()) != kind)
    return fmt::format("is {}, not {}", kind_name(value.index()), kind_name(static_cast<std::size_t>(kind)));
  bool in_range = true;
  if (const auto* whole = std::get_if<std::int64_t>(&value)) {
    in_range = *whole >= s.integer_min && *whole <= s.integer_max;
  } else if (const auto* number = std::get_if<double>(&value)) {
    in_range = is_in(s, *number);
  } else if (const auto* triple = std::get_if<Setting::Triple>(&value)) {
    in_range = std::all_of(triple->begin(), triple->end(), [&s](double n) { return is_in(s, n); });
  } else if (const auto* text = std::get_if<std::string>(&value)) {
    return check_text(s, *text);
  }
  return in_range ? std::string() : fmt::format("{} is not in {}", to_toml(value), range(s));
}

bool parse_words(const Setting& s, const std::vector<std::string>& words, Setting::Value& value, std::string& error) {
  const Setting::Kind kind = s.kind();
  // The present value gives the kind to parse into.
  value = s.get();
  bool parsed = words.size() == (kind == Setting::Kind::triple ? 3u : 1u);
  if (parsed) {
    std::visit(
        [&](auto& to) {
          using T = std::decay_t<decltype(to)>;
          if constexpr (std::is_same_v<T, bool>) {
            parsed = parse_boolean(words[0], to);
          } else if constexpr (std::is_same_v<T, std::string>) {
            to = words[0];
          } else if constexpr (std::is_same_v<T, Setting::Triple>) {
            for (std::size_t i = 0; i < to.size(); ++i) parsed = parsed && parse(words[i], to[i]);
          } else {
            parsed = parse(words[0], to);
          }
        },
        value);
  }
  if (!parsed) {
    error = fmt::format("'{}' is not {}", fmt::join(words, " "),
                        kind == Setting::Kind::boolean ? "on or off" : kind_name(static_cast<std::size_t>(kind)));
    return false;
  }
  error = check(s, value);
  HAIRNET_ASSERT(static_cast<Setting::Kind>(value.index()) == kind);
  return error.empty();
}

std::string to_toml(const Setting::Value& value) {
  return std::visit(
      [](const auto& v) -> std::string {
        using T = std::decay_t<decltype(v)>;
        if constexpr (std::is_same_v<T, std::string>) {
          std::string text = "\"";
          for (const char c : v) {
            // check_text() has refused control characters, so these two are all that TOML needs escaped.
            if (c == '"' || c == '\\') text += '\\';
            text += c;
          }
          return text + '"';
        } else if constexpr (std::is_same_v<T, Setting::Triple>) {
          return fmt::format("[{}]", fmt::join(v, ", "));
        } else {
          return fmt::format("{}", v);
        }
      },
      value);
}

}  // namespace hairnet::server
