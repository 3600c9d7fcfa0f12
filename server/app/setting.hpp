#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <string>
#include <variant>
#include <vector>

namespace hairnet::server {

// One setting: a flag, a key of the configuration file, and its place in a Config.
struct Setting {
  using Triple = std::array<double, 3>;
  using Value = std::variant<bool, std::int64_t, double, std::string, Triple>;
  // Follows the order of Value's alternatives.
  enum class Kind : std::uint8_t { boolean, integer, number, text, triple };

  // The section and the key of the setting in the file.
  std::string section, key;
  // The flag with its dashes, such as "--port".
  std::string flag;
  // One line about the setting, which --help prints.
  std::string about;
  std::function<Value()> get;
  // Sets the value, which check() has passed.
  std::function<void(const Value&)> set;
  // The bounds of an integer.
  std::int64_t integer_min = 0, integer_max = 0;
  // The bounds of a number, and of each number of a triple.
  double number_min = 0, number_max = 0;
  // A text must be one of these; empty: any text is valid.
  std::vector<std::string> choices;
  // A text may be empty.
  bool may_be_empty = true;

  [[nodiscard]] Kind kind() const { return static_cast<Kind>(get().index()); }
  [[nodiscard]] std::string name() const { return section + "." + key; }
};

// Returns an empty string when the value is valid; else the error, without the setting's name. Converts an integer
// `value` to a number where the setting is a number.
std::string check(const Setting& setting, Setting::Value& value);
// Parses and checks the words of a flag as a value of the setting's kind. On failure returns false and sets `error`.
bool parse_words(const Setting& setting, const std::vector<std::string>& words, Setting::Value& value,
                 std::string& error);
// The value in TOML: text in quotes, a triple as an array.
std::string to_toml(const Setting::Value& value);

}  // namespace hairnet::server
