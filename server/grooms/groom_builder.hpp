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
  // Counts jobs in their order, from 1.
  std::uint64_t number = 0;
  wire::GroomHash hash{};
  // The file of that hash, in pieces (chunks) or whole (bytes); without both, the file is in the groom cache.
  std::vector<std::vector<std::uint8_t>> chunks;
  std::shared_ptr<const std::vector<std::uint8_t>> bytes = nullptr;
};

struct GroomResult {
  enum class Outcome : std::uint8_t {
    // The file is a groom within limits, and its build begins; `ready` or `refused` follows.
    building,
    ready,
    refused,
    // The groom cache did not have the file.
    absent,
    // It is the answer to read(); nothing is built.
    read,
  };
  // The job's number; zero: the result is the answer to read().
  std::uint64_t job = 0;
  wire::GroomHash hash{};
  Outcome outcome = Outcome::building;
  // A refusal has an error, which `detail` describes.
  BuildError error = BuildError::none;
  std::string detail;
  // A ready groom has levels and the file of its basis, and the file of its learnt hair or null.
  std::shared_ptr<const LevelSet> levels;
  std::shared_ptr<const std::vector<std::uint8_t>> basis;
  std::shared_ptr<const std::vector<std::uint8_t>> learnt;
  // The file, when building or read; null when read: the cache does not have it.
  std::shared_ptr<const std::vector<std::uint8_t>> bytes;
  // The number of strands, when building; the store checks it against the limits of the groom's users.
  std::size_t strand_count = 0;
  // The builder took this long, when ready or refused.
  std::int64_t build_ns = 0;
};

struct GroomBuilderDef {
  LevelBuildDef build;
  BuildLevels build_levels = build_levels_in_process;
  // Bounds one file.
  std::size_t bytes_max = std::size_t{64} << 20;
  // A cache may be null, and else outlives the builder.
  LevelCache* levels = nullptr;
  GroomCache* grooms = nullptr;
  // Without a clock builds have no time limit.
  ClockNs now_ns = nullptr;
};

// Makes the levels of a groom's file: decodes the file, estimates the build, and builds the levels or reads them from
// the cache. A build takes about a second, so it runs on a thread of low priority; its loops have more such threads, or
// a process of their own. The I/O thread puts jobs and takes results. The builder does not choose between jobs:
// BuildTurns does, and gives one at a time.
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
  // Refuses the current job soon, and each later one.
  void cancel() { cancelled_ = true; }

  // on_job wakes the builder's thread, on_result the I/O thread. Set them before use.
  std::function<void()> on_job, on_result;

 private:
  static void check(const GroomResult& result);
  // Puts a result into the queue to the I/O thread.
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
  // One entry for each groom: GroomFiles asks once for all sessions that wait.
  BoundedQueue<wire::GroomHash> reads_;
  struct Learnt {
    wire::GroomHash groom{};
    std::shared_ptr<const LevelSet> levels;
  };
  BoundedQueue<Learnt> learnt_;
  // Has no bound, since BuildTurns gives one job after the other.
  BoundedQueue<GroomJob> jobs_;
  // At most two for each job, and one for each read, so put() needs no bound.
  BoundedQueue<GroomResult> results_;
  // The number of the job that drop() has named last.
  std::atomic<std::uint64_t> dropped_{0};
  // cancel() and refresh() were called.
  std::atomic<bool> cancelled_{false}, refresh_{false};
  // Reads and jobs take turns: the last poll() tried a read first.
  bool is_reading_next_ = false;
};

}  // namespace hairnet::server
