#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "core/groom/groom.hpp"
#include "core/levels/level.hpp"
#include "core/world/step_cost.hpp"
#include "schema/wire/messages.hpp"
#include "server/grooms/groom_cache.hpp"
#include "server/grooms/level_cache.hpp"
#include "server/threading/bounded_queue.hpp"

namespace hairnet::server {

struct GroomJob {
  wire::GroomHash hash{};
  std::vector<std::vector<std::uint8_t>> chunks;  // of the upload, in order; empty: read it from the groom cache
};

struct GroomResult {
  enum class Fault : std::uint8_t { none, hash, size, invalid, time, stopping };
  enum class Outcome : std::uint8_t {
    building,  // the bytes match the hash, and the groom is within limits; ready or refused follows
    ready,
    refused,
    absent,  // the groom cache did not have the file
    read,    // the answer to read(); nothing is built
  };
  wire::GroomHash hash{};
  Outcome outcome = Outcome::building;
  Fault fault = Fault::none;                               // when refused
  std::string detail;                                      // of the fault
  std::shared_ptr<const LevelSet> levels;                  // when ready
  std::shared_ptr<const std::vector<std::uint8_t>> bytes;  // of the file, when building or read; null when read: absent
  std::size_t strand_count = 0;                            // when building
};

struct GroomBuilderDef {
  GroomLimits limits;
  std::size_t bytes_max = std::size_t{64} << 20;  // of one file
  std::size_t queue_max = 16;
  std::size_t thread_count = 1;                 // of a build, including the builder's own
  LevelCache* levels = nullptr;                 // null: none; else outlives the builder
  GroomCache* grooms = nullptr;                 // null: none; else outlives the builder
  ClockNs now_ns = nullptr;                     // null: builds have no time limit
  std::int64_t build_ns_max = 600'000'000'000;  // the builder has low priority, so a busy machine needs long
};

// Makes levels of uploaded bytes: checks the hash, decodes, and builds the levels or reads them from the cache. That
// takes about a second, so it runs on a thread of low priority, which starts more such threads for each build. The I/O
// thread puts jobs and takes results.
class GroomBuilder {
 public:
  explicit GroomBuilder(const GroomBuilderDef& def);

  // I/O thread. False when the queue is full.
  bool try_put(GroomJob& job);
  // Whether the groom cache had the groom when its folder was last listed. Does not read the disk.
  [[nodiscard]] bool is_cached(const wire::GroomHash& groom) const {
    return def_.grooms && def_.grooms->is_cached(groom);
  }
  // Reads a groom from the cache, in turn with jobs.
  void read(const wire::GroomHash& groom);
  // Lists the cache's folder again, on the builder's thread.
  void refresh();
  bool take(GroomResult& result) { return results_.take(result); }

  // Does one job or read, on the builder's thread. False when there was none.
  bool poll();
  void cancel() { cancelled_ = true; }  // refuses the current job soon

  std::function<void()> on_job, on_result;  // wake the other side; set before use

 private:
  static void check(const GroomResult& result);
  void put(GroomResult result);
  void wake();
  bool poll_read();
  bool poll_job();
  void build(GroomJob job);
  // Null when the build took too long or was cancelled.
  std::shared_ptr<const LevelSet> levels_of(const wire::GroomHash& hash, const Groom& groom) const;

  GroomBuilderDef def_;
  BoundedQueue<wire::GroomHash> reads_;  // one a groom
  BoundedQueue<GroomJob> jobs_;
  BoundedQueue<GroomResult> results_;  // at most two a job
  std::atomic<bool> cancelled_{false}, refresh_{false};
  bool is_reading_next_ = false;
};

}  // namespace hairnet::server
