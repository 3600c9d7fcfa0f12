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

// What the I/O thread asks of the builder: the levels of one groom.
struct GroomJob {
  // The number of the job: 1 for the first one.
  std::uint64_t number = 0;
  wire::GroomHash hash{};
  // The file of that hash, in pieces (chunks) or whole (bytes); without both, the file is in the groom cache.
  std::vector<std::vector<std::uint8_t>> chunks;
  std::shared_ptr<const std::vector<std::uint8_t>> bytes = nullptr;
};

// What the builder answers: `building` and then the outcome of a job, or the answer to a read.
struct GroomResult {
  enum class Outcome : std::uint8_t {
    // The file is a groom within limits, and its build begins; `ready` or `refused` follows.
    building,
    ready,
    refused,
    // The groom cache did not have the file.
    absent,
    // The result is the answer to read(), and nothing was built.
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
  // A file may have at most this many bytes, packed and unpacked.
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
  // Asserts what GroomStore relies on, for each kind of result.
  static void check(const GroomResult& result);
  // Puts a result into the queue to the I/O thread.
  void give(GroomResult result);
  // Calls on_job, if it is set.
  void wake();
  // These two do one read, or one job. They return false when there was none.
  bool poll_read();
  bool poll_job();
  // Does the job and gives its last result. A lack of memory is an error of the server.
  void do_job(GroomJob job);
  // Gets the file, checks and decodes it, gives the result `building`, and builds the levels. Returns the last result
  // of the job.
  GroomResult build(GroomJob job);
  // Builds the levels of the decoded groom within the limits. Returns a result that is `refused` or `ready`.
  GroomResult build(const GroomJob& job, const std::vector<std::uint8_t>& file, const Groom& groom) const;
  // Reads the levels from the cache, or builds them and puts them there. `goes_on` is asked during the build.
  [[nodiscard]] LevelBuild levels_of(const GroomJob& job, const std::vector<std::uint8_t>& file, const Groom& groom,
                                     const GoesOn& goes_on) const;
  // The time for limits and measurements; always 0 without a clock.
  [[nodiscard]] std::int64_t clock_ns() const { return def_.now_ns ? def_.now_ns() : 0; }

  GroomBuilderDef def_;
  // The grooms to read for downloads. Each is there once, because GroomFiles asks once for all sessions that wait.
  BoundedQueue<wire::GroomHash> reads_;
  // Levels with learnt hair that wait to be written to the level cache.
  struct Learnt {
    wire::GroomHash groom{};
    std::shared_ptr<const LevelSet> levels;
  };
  BoundedQueue<Learnt> learnt_;
  // The jobs. The queue needs no bound, since BuildTurns gives one job after the other.
  BoundedQueue<GroomJob> jobs_;
  // The results: at most two for each job and one for each read, so the queue needs no bound.
  BoundedQueue<GroomResult> results_;
  // The number of the job that drop() has named last.
  std::atomic<std::uint64_t> dropped_{0};
  // cancelled_: cancel() was called. refresh_: refresh() was called, and poll() has not listed the folder yet.
  std::atomic<bool> cancelled_{false}, refresh_{false};
  // Reads and jobs take turns: true when the last poll() tried a read before a job.
  bool is_reading_next_ = false;
};

}  // namespace hairnet::server
