#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cctype>
#include <concepts>
#include <ostream>
#include <string>
#include <string_view>
#include <tuple>

// Names of the cases of parameterised tests. A case is named by its value as GoogleTest prints it, so a case that is a
// struct has a PrintTo, which prints its name.
namespace hairnet::support {

// A case whose value has no printable name, for example an enumerator.
template <class Value>
struct Named {
  std::string_view name;
  Value value;

  friend void PrintTo(const Named& named, std::ostream* out) { *out << named.name; }
};
template <class Value>
Named(const char*, Value) -> Named<Value>;

template <class Value>
// Returns the text of a value, or of several values of a tuple with "_" between them.
std::string case_text(const Value& value) {
  if constexpr (std::convertible_to<Value, std::string_view>) {
    // GoogleTest would print quotes around the text.
    return std::string(std::string_view(value));
  } else {
    return testing::PrintToString(value);
  }
}
template <class First, class... Rest>
std::string case_text(const std::tuple<First, Rest...>& values) {
  return std::apply(
      [](const First& first, const Rest&... rest) {
        std::string text = case_text(first);
        ((text += '_', text += case_text(rest)), ...);
        return text;
      },
      values);
}

// The last argument of INSTANTIATE_TEST_SUITE_P. Names have letters, digits and "_" only, so all other characters of
// the value's text become "_". `unit` follows the text of a number: CaseName{"_nodes"}.
struct CaseName {
  std::string_view unit = {};

  template <class Value>
  std::string operator()(const testing::TestParamInfo<Value>& test) const {
    std::string name = case_text(test.param) + std::string(unit);
    std::ranges::replace_if(
        name, [](unsigned char c) { return std::isalnum(c) == 0; }, '_');
    return name;
  }
};

}  // namespace hairnet::support
