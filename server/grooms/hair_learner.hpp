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
  // The levels of the groom, with modes and maps.
  std::shared_ptr<const LevelSet> levels;
  std::shared_ptr<const std::vector<std::uint8_t>> file;
};

struct LearningResult {
  wire::GroomHash groom{};
  // The levels of the job with the learnt level; null: refused, or dropped.
  std::shared_ptr<const LevelSet> levels;
  // The file of the learnt hair, for clients.
  std::shared_ptr<const std::vector<std::uint8_t>> file;
  // Says in one line why it was refused; empty: it was dropped.
  std::string detail;
  // Memory was lacking, so nothing is wrong with the groom: its hair can be learnt later.
  bool lacked_memory = false;
  // The learnt hair was in the groom's file, and was measured to be good.
  bool is_accepted = false;
  // Says in one line why the learnt hair of the groom's file was not taken; empty: it was taken, or there is none.
  std::string file_detail;
  std::int64_t taken_ns = 0;
};

// learn_hair() with its usual settings, on one thread. Tests learn less.
using LearnHair = std::function<Result<std::shared_ptr<const LearntHair>>(
    const Groom& groom, const std::shared_ptr<const LevelSet>& levels, const BuildCallbacks& callbacks)>;
Result<std::shared_ptr<const LearntHair>> learn_hair_in_process(const Groom& groom,
                                                                const std::shared_ptr<const LevelSet>& levels,
                                                                const BuildCallbacks& callbacks);

struct HairLearnerDef {
  GroomLimits groom;
  LearnHair learn = learn_hair_in_process;
  ClockNs now_ns = nullptr;
};

// Learns the hair of one groom after the other, on a thread of low priority: about a minute each. Hair that is in the
// groom's file is measured, and taken over where it errs less than the low level, because a client may have sent
// anything there. A network that errs more than the low level is refused; one that does so in wind alone is learnt for
// still air. The I/O thread puts jobs and takes results.
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

  // on_job wakes the learner's thread, on_result the I/O thread. Set them before use.
  std::function<void()> on_job, on_result;

 private:
  LearningResult learn(const LearningJob& job);
  // Returns the learnt hair of the file; null: there is none that can be taken, or the job was dropped.
  std::shared_ptr<const LearntHair> accept_given(const LearningJob& job, const Groom& groom,
                                                 const BuildCallbacks& callbacks, LearningResult& result) const;
  [[nodiscard]] std::int64_t clock_ns() const { return def_.now_ns ? def_.now_ns() : 0; }

  HairLearnerDef def_;
  // The jobs. The queue needs no bound, since LearningTurns gives one job after the other.
  BoundedQueue<LearningJob> jobs_;
  // The results, one for each job.
  BoundedQueue<LearningResult> results_;
  std::atomic<bool> dropped_{false}, cancelled_{false};
};

}  // namespace hairnet::server
