#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "core/build/level.hpp"
#include "core/groom/groom.hpp"
#include "schema/wire/messages.hpp"
#include "server/room/bounded_queue.hpp"
#include "server/tick/level_cache.hpp"

namespace hairnet::server {

struct GroomJob {
  wire::GroomHash hash{};
  std::vector<std::vector<std::uint8_t>> chunks;  // in order
};

struct GroomResult {
  wire::GroomHash hash{};
  wire::GroomState state = wire::GroomState::building;  // then ready or refused
  wire::ErrorReason reason = wire::ErrorReason::none;   // when refused
  std::string detail;
  std::shared_ptr<const LevelSet> levels;
  std::shared_ptr<const std::vector<std::uint8_t>> bytes;  // of the file, when it is ready
};

// Uploaded bytes to levels: check the hash, decode, build, or read from the cache what was built before. A second of
// work, so it has a thread of low priority of its own, which brings others like it for a build; the I/O thread puts
// jobs and takes results.
class GroomBuilder {
 public:
  // `thread_count`: of a build, the builder's own among them. `cache`: null for none; must outlive the builder.
  GroomBuilder(const GroomLimits& limits, std::size_t queue_max, std::size_t thread_count = 1,
               LevelCache* cache = nullptr);

  // False when the queue is full.
  bool try_put(GroomJob& job);
  // Does one job, on the builder's thread. False when there is none.
  bool poll();
  void cancel() { cancelled_ = true; }  // the job being done ends soon, refused
  bool take(GroomResult& result) { return results_.take(result); }

  std::function<void()> on_job, on_result;  // wake the other side; set before use

 private:
  GroomResult build(GroomJob job) const;
  // Null when cancelled.
  std::shared_ptr<const LevelSet> levels_of(const wire::GroomHash& hash, const Groom& groom) const;

  GroomLimits limits_;
  std::size_t thread_count_;
  LevelCache* cache_;
  BoundedQueue<GroomJob> jobs_;
  BoundedQueue<GroomResult> results_;  // at most two a job
  std::atomic<bool> cancelled_{false};
};

}  // namespace hairnet::server
