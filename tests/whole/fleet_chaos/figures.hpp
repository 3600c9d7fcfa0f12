#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace hairnet::whole {

// Times of one kind, for the share of them that a percentile names.
class Times {
 public:
  void add(std::int64_t ns) { ns_.push_back(ns); }
  [[nodiscard]] std::size_t count() const { return ns_.size(); }
  [[nodiscard]] std::size_t count_above(std::int64_t ns) const;
  // "p50 p99 max" in seconds; dashes without any.
  [[nodiscard]] std::string text() const;

 private:
  std::vector<std::int64_t> ns_;
};

}  // namespace hairnet::whole
