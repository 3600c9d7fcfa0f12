#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "core/groom/groom.hpp"
#include "core/learning/learn_hair.hpp"
#include "core/levels/level.hpp"
#include "core/world/step_cost.hpp"
#include "schema/wire/messages.hpp"
#include "server/threading/bounded_queue.hpp"

namespace hairnet::server {

struct LearningJob {
  wire::GroomHash groom{};
  // These have modes and maps.
  std::shared_ptr<const LevelSet> levels;
  std::shared_ptr<const std::vector<std::uint8_t>> file;
};

struct LearningResult {
  wire::GroomHash groom{};
  // These are the same with the learnt level; null: refused, or dropped.
  std::shared_ptr<const LevelSet> levels;
  // Has the learnt hair, for clients.
  std::shared_ptr<const std::vector<std::uint8_t>> file;
  // Says in one line why it was refused; empty: it was dropped.
  std::string detail;
  // The learnt hair is that of the groom's file.
  bool is_adopted = false;
  // Says in one line why that of the file was not taken; empty: it was taken, or there is none.
  std::string file_detail;
  std::int64_t taken_ns = 0;
};

// learn_hair() with its usual settings, on one thread. Tests learn less.
using LearnHair = std::function<Result<std::shared_ptr<const LearntHair>>(
    const Groom& groom, const std::shared_ptr<const LevelSet>& levels, const BuildCallbacks& callbacks)>;
Result<std::shared_ptr<const LearntHair>> learn_hair_here(const Groom& groom,
                                                          const std::shared_ptr<const LevelSet>& levels,
                                                          const BuildCallbacks& callbacks);

struct HairLearnerDef {
  GroomLimits groom;
  LearnHair learn = learn_hair_here;
  ClockNs now_ns = nullptr;
};

// Learns the hair of one groom after the other, on a thread of low priority: about a minute each. Hair that is in the
// groom's file is measured, and taken over where it is good. The I/O thread puts jobs and takes results.
class HairLearner {
 public:
  explicit HairLearner(const HairLearnerDef& def) : def_(def), jobs_(0), results_(0) {}

  // I/O thread.
  void put(LearningJob job);
  bool take(LearningResult& result) { return results_.take(result); }
  // Ends the job under way soon.
  void drop() { dropped_ = true; }

  // Does one job, on the learner's thread. False when there was none.
  bool poll();
  void cancel() { cancelled_ = true; }

  std::function<void()> on_job, on_result;  // wake the other side; set before use

 private:
  LearningResult learn(const LearningJob& job);
  // Returns the learnt hair of the file; null: there is none that can be taken, or the job was dropped.
  std::shared_ptr<const LearntHair> adopt(const LearningJob& job, const Groom& groom, const BuildCallbacks& callbacks,
                                          LearningResult& result) const;
  [[nodiscard]] std::int64_t clock_ns() const { return def_.now_ns ? def_.now_ns() : 0; }

  HairLearnerDef def_;
  BoundedQueue<LearningJob> jobs_;        // the store gives one after the other
  BoundedQueue<LearningResult> results_;  // one a job
  std::atomic<bool> dropped_{false}, cancelled_{false};
};

}  // namespace hairnet::server
