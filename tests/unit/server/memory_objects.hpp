#pragma once

#include <algorithm>
#include <map>
#include <string>
#include <vector>

#include "server/objects/object_store.hpp"

namespace hairnet::server {

// An object store in memory, which tests make fail.
class MemoryObjects final : public ObjectStore {
 public:
  ObjectAnswer get(std::string_view name, std::size_t bytes_max) override {
    gets.emplace_back(name);
    if (failure != ObjectAnswer::Outcome::read) return {failure, {}, "as told"};
    const auto found = objects.find(std::string(name));
    if (found == objects.end()) return {ObjectAnswer::Outcome::absent, {}, {}};
    if (found->second.size() > bytes_max) return {ObjectAnswer::Outcome::too_large, {}, "too large"};
    return {ObjectAnswer::Outcome::read, found->second, {}};
  }
  ObjectAnswer put(std::string_view name, std::span<const std::uint8_t> bytes, Existing existing) override {
    puts.emplace_back(name);
    if (failure != ObjectAnswer::Outcome::read) return {failure, {}, "as told"};
    if (existing == Existing::keep && objects.contains(std::string(name))) return {ObjectAnswer::Outcome::kept, {}, {}};
    objects[std::string(name)].assign(bytes.begin(), bytes.end());
    return {ObjectAnswer::Outcome::stored, {}, {}};
  }
  [[nodiscard]] bool takes_gets() const override { return is_open; }
  [[nodiscard]] bool takes_puts() const override { return is_open; }
  void cancel() override { is_open = false; }

  std::map<std::string, std::vector<std::uint8_t>> objects;
  // The names of the objects that were asked for and written, in order.
  std::vector<std::string> gets, puts;
  // Every call fails so; `read` means that none fails.
  ObjectAnswer::Outcome failure = ObjectAnswer::Outcome::read;
  bool is_open = true;
};

}  // namespace hairnet::server
