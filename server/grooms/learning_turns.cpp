#include "server/grooms/learning_turns.hpp"

#include <spdlog/spdlog.h>

#include <utility>

#include "core/assert.hpp"
#include "core/learnt/learnt_hair.hpp"
#include "server/telemetry/log_hash.hpp"
#include "server/telemetry/log_text.hpp"

namespace hairnet::server {
namespace {

// LevelChooser raises characters again within a second or two, so a shortage that lasts longer is a true one.
constexpr std::int64_t kShortFor_ns = 5'000'000'000;

}  // namespace

void LearningTurns::learn_with(HairLearner& learner, std::function<bool()> is_short) {
  HAIRNET_ASSERT(is_short);
  learner_ = &learner;
  is_short_ = std::move(is_short);
}

void LearningTurns::erase(const wire::GroomHash& groom) {
  is_decided_.erase(groom);
  // The result still comes, as one that was dropped, and take() then ends the job.
  if (learning_ == groom) learner_->drop();
}

std::optional<wire::GroomHash> LearningTurns::next(const std::function<std::size_t(const wire::GroomHash&)>& user_count,
                                                   std::int64_t now_ns) {
  if (!learner_) return std::nullopt;
  if (!is_short_())
    short_since_ns_.reset();
  else if (!short_since_ns_)
    short_since_ns_ = now_ns;
  // Learning takes a processor for about a minute: by default only a server that is short of time does it.
  const bool is_wanted = when_ == Learning::always || (when_ == Learning::when_short && short_since_ns_ &&
                                                       now_ns - *short_since_ns_ >= kShortFor_ns);
  if (std::exchange(has_lacked_memory_, false)) paused_until_ns_ = now_ns + kMemoryPause_ns;
  if (!is_wanted || learning_ || now_ns < paused_until_ns_) return std::nullopt;
  std::optional<wire::GroomHash> next;
  std::size_t most = 0;
  for (const auto& [groom, is_decided] : is_decided_) {
    const std::size_t count = is_decided ? 0 : user_count(groom);
    // A groom without users counts as none: nobody would see its learnt hair.
    if (count <= most) continue;
    most = count;
    next = groom;
  }
  // The mark is set before the result: a groom that cannot be learnt must not come up at each poll.
  if (next) is_decided_[*next] = true;
  return next;
}

void LearningTurns::begin(LearningJob job) {
  HAIRNET_ASSERT(!learning_);
  learning_ = job.groom;
  learner_->put(std::move(job));
}

bool LearningTurns::take(LearningResult& result) {
  while (learner_ && learner_->take(result)) {
    HAIRNET_ASSERT(learning_ == result.groom);
    learning_.reset();
    const auto groom = is_decided_.find(result.groom);
    if (result.lacked_memory && groom != is_decided_.end()) {
      groom->second = false;
      has_lacked_memory_ = true;
    }
    if (groom == is_decided_.end() || !note(result)) continue;
    // The groom may have been evicted and come back meanwhile: it has its learnt hair now.
    groom->second = true;
    return true;
  }
  return false;
}

bool LearningTurns::note(const LearningResult& result) const {
  if (!result.file_detail.empty()) {
    counters_->grooms_learnt_file_refused.add();
    spdlog::info("event=groom_learnt_file_refused groom={} detail={}", log_hash(result.groom),
                 log_text(result.file_detail));
  }
  if (!result.levels) {
    if (result.detail.empty()) return false;
    counters_->grooms_learnt_refused.add();
    spdlog::info("event=groom_learnt_refused groom={} detail={}", log_hash(result.groom), log_text(result.detail));
    return false;
  }
  const LearntHair& learnt = *result.levels->learnt;
  counters_->grooms_learnt.add();
  if (result.is_accepted) counters_->grooms_learnt_accepted.add();
  if (learnt.wind.weights.empty()) counters_->grooms_learnt_refused_in_wind.add();
  spdlog::info(
      "event=groom_learnt groom={} from={} error={:.3f} low_error={:.3f} wind_error={:.3f} wind_low_error={:.3f} "
      "seconds={:.1f}",
      log_hash(result.groom), result.is_accepted ? "file" : "motions", learnt.error, learnt.low_error,
      learnt.wind.error, learnt.wind.low_error, static_cast<double>(result.taken_ns) * 1e-9);
  return true;
}

}  // namespace hairnet::server
