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
#include "server/grooms/level_build.hpp"
#include "server/grooms/level_cache.hpp"
#include "server/threading/bounded_queue.hpp"

namespace hairnet::server {

struct GroomJob {
  std::uint64_t number = 0;  // in the order of jobs, from 1
  wire::GroomHash hash{};
  // The file of that hash, in pieces or whole; neither: it is in the groom cache.
  std::vector<std::vector<std::uint8_t>> chunks;
  std::shared_ptr<const std::vector<std::uint8_t>> bytes = nullptr;
};

struct GroomResult {
  enum class Outcome : std::uint8_t {
    building,  // it is a groom within limits; ready or refused follows
    ready,
    refused,
    absent,  // the groom cache did not have the file
    read,    // the answer to read(); nothing is built
  };
  std::uint64_t job = 0;  // its number; 0: the answer to read()
  wire::GroomHash hash{};
  Outcome outcome = Outcome::building;
  BuildFault fault = BuildFault::none;                      // when refused
  std::string detail;                                       // of the fault
  std::shared_ptr<const LevelSet> levels;                   // when ready
  std::shared_ptr<const std::vector<std::uint8_t>> basis;   // when ready: the file of the basis
  std::shared_ptr<const std::vector<std::uint8_t>> learnt;  // when ready: that of the learnt hair; null: none
  std::shared_ptr<const std::vector<std::uint8_t>> bytes;  // of the file, when building or read; null when read: absent
  std::size_t strand_count = 0;                            // when building
  std::int64_t build_ns = 0;                               // that the builder took, when ready or refused
};

struct GroomBuilderDef {
  LevelBuildDef build;
  BuildLevels build_levels = build_levels_here;
  std::size_t bytes_max = std::size_t{64} << 20;  // of one file
  LevelCache* levels = nullptr;                   // null: none; else outlives the builder
  GroomCache* grooms = nullptr;                   // null: none; else outlives the builder
  ClockNs now_ns = nullptr;                       // null: builds have no time limit
};

// Makes levels of a groom's file: decodes it, estimates the build, and builds the levels or reads them from the cache.
// That takes about a second, so it runs on a thread of low priority; a build has more such threads, or a process. The
// I/O thread puts jobs and takes results.
class GroomBuilder {
 public:
  explicit GroomBuilder(const GroomBuilderDef& def);

  // I/O thread.
  void put(GroomJob job);
  // Refuses the job soon, unless it has ended. I/O thread.
  void drop(std::uint64_t job) { dropped_ = job; }
  // Whether the groom cache had the groom when its folder was last listed. Does not read the disk.
  [[nodiscard]] bool is_cached(const wire::GroomHash& groom) const {
    return def_.grooms && def_.grooms->is_cached(groom);
  }
  // Reads a groom from the cache, in turn with jobs.
  void read(const wire::GroomHash& groom);
  // Writes levels that have been learnt meanwhile to the level cache, in turn with jobs.
  void cache(const wire::GroomHash& groom, std::shared_ptr<const LevelSet> levels);
  // Lists the cache's folder again, on the builder's thread.
  void refresh();
  bool take(GroomResult& result) { return results_.take(result); }

  // Does one job or read, on the builder's thread. False when there was none.
  bool poll();
  void cancel() { cancelled_ = true; }  // refuses the current job soon

  std::function<void()> on_job, on_result;  // wake the other side; set before use

 private:
  static void check(const GroomResult& result);
  void give(GroomResult result);
  void wake();
  bool poll_read();
  bool poll_job();
  void do_job(GroomJob job);
  GroomResult build(GroomJob job);
  // Refused, or ready.
  GroomResult build(const GroomJob& job, const std::vector<std::uint8_t>& file, const Groom& groom) const;
  [[nodiscard]] LevelBuild levels_of(const GroomJob& job, const std::vector<std::uint8_t>& file, const Groom& groom,
                                     const GoesOn& goes_on) const;
  [[nodiscard]] std::int64_t clock_ns() const { return def_.now_ns ? def_.now_ns() : 0; }

  GroomBuilderDef def_;
  BoundedQueue<wire::GroomHash> reads_;  // one a groom
  struct Learnt {
    wire::GroomHash groom{};
    std::shared_ptr<const LevelSet> levels;
  };
  BoundedQueue<Learnt> learnt_;
  BoundedQueue<GroomJob> jobs_;        // the store gives one after the other
  BoundedQueue<GroomResult> results_;  // at most two a job
  std::atomic<std::uint64_t> dropped_{0};
  std::atomic<bool> cancelled_{false}, refresh_{false};
  bool is_reading_next_ = false;
};

}  // namespace hairnet::server
