#pragma once

#include <cstdint>
#include <functional>
#include <limits>
#include <map>
#include <optional>
#include <utility>

#include "server/grooms/groom_counters.hpp"
#include "server/grooms/groom_store_limits.hpp"
#include "server/grooms/hair_learner.hpp"

namespace hairnet::server {

// Decides when hair is learnt, and of which groom: of one at a time, that with the most users first, and of each once.
// A groom whose hair was refused is not tried again; where memory was lacking, nothing is learnt for kMemoryPause_ns.
// Without a learner no hair is learnt. I/O thread.
class LearningTurns {
 public:
  static constexpr std::int64_t kMemoryPause_ns = 60'000'000'000;

  LearningTurns(Learning when, GroomCounters& counters) : when_(when), counters_(&counters) {}
  // `is_short`: the tick has too little time for the levels asked for.
  void learn_with(HairLearner& learner, std::function<bool()> is_short);

  // The groom is ready, and may have learnt hair already.
  void add(const wire::GroomHash& groom, bool has_learnt) { is_decided_[groom] = has_learnt; }
  // The groom is not in memory any more. Its job under way ends soon.
  void erase(const wire::GroomHash& groom);
  // Takes levels with learnt hair of a groom that is still here. Logs and counts them and what was refused.
  bool take(LearningResult& result);
  // Returns the groom whose turn it is, at most once. Its hair is not learnt unless begin() follows.
  std::optional<wire::GroomHash> next(const std::function<std::size_t(const wire::GroomHash&)>& user_count,
                                      std::int64_t now_ns);
  // Gives the learner the job. Asserts that none is under way.
  void begin(LearningJob job);

 private:
  // Logs and counts the result. Returns false when nothing was learnt.
  [[nodiscard]] bool note(const LearningResult& result) const;

  Learning when_;
  GroomCounters* counters_;
  HairLearner* learner_ = nullptr;
  std::function<bool()> is_short_;
  // is_short_ has returned true at each call since this time.
  std::optional<std::int64_t> short_since_ns_;
  // Memory was lacking; the pause begins with the next call that has a time.
  bool has_lacked_memory_ = false;
  std::int64_t paused_until_ns_ = std::numeric_limits<std::int64_t>::min();
  // Every groom that is ready; true: its hair was learnt or refused, or is being learnt, so it is not learnt again.
  std::map<wire::GroomHash, bool> is_decided_;
  // The groom of the job under way. It stays until the result has come, even if the groom is gone.
  std::optional<wire::GroomHash> learning_;
};

}  // namespace hairnet::server
