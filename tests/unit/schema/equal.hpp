#pragma once

#include <algorithm>
#include <memory>
#include <optional>
#include <ranges>
#include <type_traits>
#include <variant>

#include "tests/support/fields.hpp"

// Compares structs field by field, by the list of tests/support/fields.hpp, without a tolerance. Pointers are equal
// when what they point to is equal.
namespace hairnet::wire {

template <class T>
bool equal(const T& a, const T& b);

inline bool equal(const Quat& a, const Quat& b) {
  return a.coeffs() == b.coeffs();
}
template <class T>
bool equal(const std::optional<T>& a, const std::optional<T>& b) {
  return a.has_value() == b.has_value() && (!a || equal(*a, *b));
}
template <class T>
bool equal(const std::shared_ptr<T>& a, const std::shared_ptr<T>& b) {
  return (a != nullptr) == (b != nullptr) && (!a || equal(*a, *b));
}
template <class... T>
bool equal(const std::variant<T...>& a, const std::variant<T...>& b) {
  return a.index() == b.index() &&
         std::visit([&](const auto& x) { return equal(x, std::get<std::decay_t<decltype(x)>>(b)); }, a);
}

template <class T>
bool equal(const T& a, const T& b) {
  if constexpr (std::ranges::range<const T>) {
    return std::ranges::equal(a, b, [](const auto& x, const auto& y) { return equal(x, y); });
  } else if constexpr (boost::describe::has_describe_members<T>::value) {
    bool all = true;
    for_each_field<T>([&](const char*, auto field) { all = all && equal(a.*field, b.*field); });
    return all;
  } else {
    return a == b;
  }
}

}  // namespace hairnet::wire
