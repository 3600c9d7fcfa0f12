#include "server/grooms/hair_learner.hpp"

#include <new>
#include <utility>

#include "core/assert.hpp"
#include "core/learning/accept_given_hair.hpp"
#include "schema/wire/groom_file.hpp"
#include "schema/wire/learnt_file.hpp"
#include "server/threading/memory_reserve.hpp"

namespace hairnet::server {

Result<std::shared_ptr<const LearntHair>> learn_hair_in_process(const Groom& groom,
                                                                const std::shared_ptr<const LevelSet>& levels,
                                                                const BuildCallbacks& callbacks) {
  return learn_hair(groom, levels, *levels->modes, callbacks);
}

void HairLearner::put(LearningJob job) {
  HAIRNET_ASSERT(job.levels && job.levels->modes && job.file);
  // No job is under way here (LearningTurns), so this cannot undo a drop() of an earlier one.
  dropped_ = false;
  jobs_.put(std::move(job));
  if (on_job) on_job();
}

bool HairLearner::poll() {
  LearningJob job;
  if (!jobs_.take(job)) return false;
  const std::int64_t begun_ns = clock_ns();
  LearningResult result;
  try {
    const MemoryReserve::MayFail may_fail;
    result = learn(job);
  } catch (const std::bad_alloc&) {
    result.detail = "the server has no memory left to learn it";
    result.lacked_memory = true;
  }
  result.groom = job.groom;
  result.taken_ns = clock_ns() - begun_ns;
  results_.put(std::move(result));
  if (on_result) on_result();
  return true;
}

std::shared_ptr<const LearntHair> HairLearner::accept_given(const LearningJob& job, const Groom& groom,
                                                            const BuildCallbacks& callbacks,
                                                            LearningResult& result) const {
  // Null without an error: the file has no learnt hair, and it is learnt here.
  const Result<std::shared_ptr<const LearntHair>> given = wire::decode_learnt_of_groom(*job.file);
  if (given && !*given) return nullptr;
  const auto accepted = given ? accept_given_hair(groom, job.levels, *job.levels->modes, **given, callbacks) : given;
  if (!accepted) result.file_detail = accepted.error();
  return accepted ? *accepted : nullptr;
}

LearningResult HairLearner::learn(const LearningJob& job) {
  LearningResult result;
  const Result<Groom> groom = wire::decode_groom(*job.file, def_.groom);
  if (!groom) {
    result.detail = groom.error();
    return result;
  }
  BuildCallbacks callbacks;
  // learn_hair() asks now and then; a no ends it without a result and without an error.
  callbacks.progress = [this](double, std::string_view) { return !dropped_ && !cancelled_; };
  Result<std::shared_ptr<const LearntHair>> learnt = accept_given(job, *groom, callbacks, result);
  // Hair in the file that is good enough saves the learning.
  result.is_accepted = *learnt != nullptr;
  if (!result.is_accepted) learnt = def_.learn(*groom, job.levels, callbacks);
  if (!learnt) {
    result.detail = learnt.error();
  } else if (*learnt) {
    // The tick uses the old set meanwhile, so a copy gets the new level. GroomReady then replaces the set.
    auto levels = std::make_shared<LevelSet>(*job.levels);
    levels->learnt = *learnt;
    result.levels = std::move(levels);
    result.file = std::make_shared<const std::vector<std::uint8_t>>(wire::encode_learnt(**learnt));
  }
  return result;
}

}  // namespace hairnet::server
