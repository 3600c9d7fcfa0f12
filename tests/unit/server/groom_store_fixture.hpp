#pragma once

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <fstream>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "schema/wire/groom_file.hpp"
#include "server/grooms/groom_store.hpp"
#include "tests/support/quick_training.hpp"
#include "tests/unit/server/small_groom.hpp"

namespace hairnet::server {

inline constexpr std::int64_t kSecond_ns = 1'000'000'000;
inline constexpr SessionId kAnna = 1, kBert = 2;

// A groom's file, or bytes that pretend to be one.
struct Upload {
  explicit Upload(std::vector<std::uint8_t> b) : bytes(std::move(b)), hash(wire::hash_groom(bytes)) {}
  std::vector<std::uint8_t> bytes;
  wire::GroomHash hash;
};

// A store and its builder without threads: chunks are taken at once, and levels are built in build(). Time stands
// still unless a test moves now_ns_.
class GroomStoreTest : public testing::Test {
 protected:
  GroomStoreTest() { make({}); }
  ~GroomStoreTest() override { std::filesystem::remove_all(folder_); }
  // Starts with an empty store; a cache of make_with_cache() stays. The clock measures builds, which have no time limit
  // without one.
  void make(const GroomStoreLimits& limits, ClockNs clock = nullptr) {
    GroomBuilderDef def;
    def.build.training = support::kQuickTraining;
    def.build.groom = limits.groom;
    def.build.ns_max = limits.build_ns_max;
    def.build.memory_bytes_max = limits.build_memory_bytes_max;
    if (build_levels_) def.build_levels = build_levels_;
    def.bytes_max = limits.groom_bytes_max;
    def.grooms = cache_ ? &*cache_ : nullptr;
    def.now_ns = clock;
    store_.reset();
    builder_ = std::make_unique<GroomBuilder>(def);
    GroomListener listener;
    listener.send = [this](SessionId session, const wire::Message& message, std::int64_t) {
      sent_.emplace_back(session, message);
    };
    listener.deliver = [this](SessionId session, const wire::GroomHash& groom, const GroomStore::Bytes& bytes,
                              std::int64_t) {
      delivered_.push_back({session, groom, bytes});
    };
    listener.revoke = [this](SessionId session, const wire::GroomHash&, std::int64_t) { lost_.push_back(session); };
    store_ = std::make_unique<GroomStore>(limits, *builder_, commands_, counters_, listener);
  }
  // Makes a new store with a cache on disk that contains these files.
  void make_with_cache(const std::vector<const Upload*>& kept, const GroomStoreLimits& limits = {}) {
    std::filesystem::remove_all(folder_);
    cache_.emplace(folder_, std::uint64_t{1} << 30, cache_counters_);
    for (const Upload* upload : kept) cache_->put(upload->hash, upload->bytes);
    make(limits);
  }
  // Overwrites bytes 100 and 101 of every file of the cache.
  void corrupt_kept() const {
    for (const auto& file : std::filesystem::directory_iterator(folder_)) {
      std::fstream corrupted(file.path(), std::ios::in | std::ios::out | std::ios::binary);
      corrupted.seekp(100);
      corrupted.put('\x55').put('\xAA');
    }
  }
  wire::ErrorReason offer(SessionId session, const Upload& upload) {
    return store_->offer(session, {upload.hash, upload.bytes.size()}, now_ns_).reason;
  }
  wire::ErrorReason chunk(SessionId session, const Upload& upload, std::size_t from, std::size_t to) {
    return store_
        ->chunk(session, {upload.hash, from, {upload.bytes.begin() + from, upload.bytes.begin() + to}}, now_ns_)
        .reason;
  }
  wire::ErrorReason send_all(SessionId session, const Upload& upload) {
    return chunk(session, upload, 0, upload.bytes.size());
  }
  void build() {
    // The store gives the builder one groom at a time, so ten rounds build up to ten grooms.
    for (int round = 0; round < 10; ++round) {
      while (builder_->poll()) {
      }
      store_->poll(now_ns_);
    }
  }
  template <class T>
  [[nodiscard]] std::vector<T> sent(SessionId session) const {
    std::vector<T> found;
    for (const auto& [to, message] : sent_) {
      if (to != session) continue;
      if (const T* m = std::get_if<T>(&message)) found.push_back(*m);
    }
    return found;
  }
  [[nodiscard]] std::vector<wire::GroomState> states(SessionId session) const {
    std::vector<wire::GroomState> found;
    for (const auto& status : sent<wire::GroomStatus>(session)) found.push_back(status.state);
    return found;
  }
  [[nodiscard]] std::vector<std::uint64_t> needs(SessionId session) const {
    std::vector<std::uint64_t> found;
    for (const auto& need : sent<wire::GroomNeed>(session)) found.push_back(need.offset);
    return found;
  }
  [[nodiscard]] std::vector<wire::ErrorReason> errors(SessionId session) const {
    std::vector<wire::ErrorReason> found;
    for (const auto& error : sent<wire::Error>(session)) found.push_back(error.reason);
    return found;
  }
  std::size_t ready_commands() {
    std::vector<Command> taken;
    commands_.take_all(taken);
    return static_cast<std::size_t>(std::count_if(
        taken.begin(), taken.end(), [](const Command& c) { return std::holds_alternative<GroomReady>(c); }));
  }

  Upload good_{wire::encode_groom(small_groom())};
  // The function with which the next make() builds levels; empty means the default.
  BuildLevels build_levels_;
  CommandQueue commands_{1000};
  GroomCounters counters_;
  std::vector<std::pair<SessionId, wire::Message>> sent_;
  struct Delivered {
    SessionId session;
    wire::GroomHash groom;
    GroomStore::Bytes bytes;
  };
  std::vector<Delivered> delivered_;
  std::vector<SessionId> lost_;
  std::filesystem::path folder_ =
      std::filesystem::path(testing::TempDir()) / ("groom_store_" + std::to_string(::getpid()));
  GroomCacheCounters cache_counters_;
  std::optional<GroomCache> cache_;
  std::unique_ptr<GroomBuilder> builder_;
  std::unique_ptr<GroomStore> store_;
  std::int64_t now_ns_ = 0;
};

}  // namespace hairnet::server
