#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "core/assert.hpp"

namespace hairnet::server {

// How many sessions and characters share a name, for limits: the name of a room, or of a subject. A name exists from
// its first enter() to its last leave(); add_character() and so on assert that it exists. I/O thread.
class CountsByName {
 public:
  struct Count {
    std::size_t sessions = 0, characters = 0;
    // The number of the name while it exists, from 1. Numbers are used again, so they stay small.
    std::uint32_t number = 0;
  };
  [[nodiscard]] std::size_t size() const { return counts_.size(); }
  // All zero for an unknown name.
  [[nodiscard]] Count count(const std::string& name) const {
    const auto found = counts_.find(name);
    return found == counts_.end() ? Count{} : found->second;
  }
  // The name that has the most characters; empty: nobody has any. It looks at every name, so call it rarely.
  [[nodiscard]] std::string largest() const {
    const auto most = std::ranges::max_element(
        counts_, [](const auto& a, const auto& b) { return a.second.characters < b.second.characters; });
    return most == counts_.end() || most->second.characters == 0 ? std::string() : most->first;
  }
  void enter(const std::string& name) {
    Count& count = counts_[name];
    if (count.sessions++ == 0) count.number = take_number();
  }
  void leave(const std::string& name, std::size_t characters) {
    Count& count = existing(name);
    HAIRNET_ASSERT(count.characters >= characters);
    count.characters -= characters;
    if (--count.sessions != 0) return;
    HAIRNET_ASSERT(count.characters == 0);
    free_numbers_.push_back(count.number);
    counts_.erase(name);
  }
  void add_character(const std::string& name) { ++existing(name).characters; }
  void remove_character(const std::string& name) {
    Count& count = existing(name);
    HAIRNET_ASSERT(count.characters > 0);
    --count.characters;
  }

 private:
  // Asserts that the name exists.
  Count& existing(const std::string& name) {
    const auto found = counts_.find(name);
    HAIRNET_ASSERT(found != counts_.end());
    return found->second;
  }
  // Returns the smallest number that no name has had, or one that is free again. Call it when counts_ has the new name
  // already: while no number is free, the other names have exactly the numbers 1 to size() - 1.
  std::uint32_t take_number() {
    if (free_numbers_.empty()) return static_cast<std::uint32_t>(counts_.size());
    const std::uint32_t number = free_numbers_.back();
    free_numbers_.pop_back();
    return number;
  }

  std::map<std::string, Count> counts_;
  // The numbers that a name had and no name has now.
  std::vector<std::uint32_t> free_numbers_;
};

}  // namespace hairnet::server
