#include "server/grooms/hair_learner.hpp"

#include <new>
#include <utility>

#include "core/assert.hpp"
#include "core/learning/adopt_hair.hpp"
#include "schema/wire/groom_file.hpp"
#include "schema/wire/learnt_file.hpp"
#include "server/threading/memory_reserve.hpp"

namespace hairnet::server {

Result<std::shared_ptr<const LearntHair>> learn_hair_here(const Groom& groom,
                                                          const std::shared_ptr<const LevelSet>& levels,
                                                          const BuildCallbacks& callbacks) {
  return learn_hair(groom, levels, *levels->modes, callbacks);
}

void HairLearner::put(LearningJob job) {
  HAIRNET_ASSERT(job.levels && job.levels->modes && job.file);
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
  }
  result.groom = job.groom;
  result.taken_ns = clock_ns() - begun_ns;
  results_.put(std::move(result));
  if (on_result) on_result();
  return true;
}

std::shared_ptr<const LearntHair> HairLearner::adopt(const LearningJob& job, const Groom& groom,
                                                     const BuildCallbacks& callbacks, LearningResult& result) const {
  const Result<std::shared_ptr<const LearntHair>> given = wire::decode_learnt_of_groom(*job.file);
  if (given && !*given) return nullptr;
  const auto adopted = given ? adopt_hair(groom, job.levels, *job.levels->modes, **given, callbacks) : given;
  if (!adopted) result.file_detail = adopted.error();
  return adopted ? *adopted : nullptr;
}

LearningResult HairLearner::learn(const LearningJob& job) {
  LearningResult result;
  const Result<Groom> groom = wire::decode_groom(*job.file, def_.groom);
  if (!groom) {
    result.detail = groom.error();
    return result;
  }
  BuildCallbacks callbacks;
  callbacks.progress = [this](double, std::string_view) { return !dropped_ && !cancelled_; };
  Result<std::shared_ptr<const LearntHair>> learnt = adopt(job, *groom, callbacks, result);
  result.is_adopted = *learnt != nullptr;
  if (!result.is_adopted) learnt = def_.learn(*groom, job.levels, callbacks);
  if (!learnt) {
    result.detail = learnt.error();
  } else if (*learnt) {
    auto levels = std::make_shared<LevelSet>(*job.levels);
    levels->learnt = *learnt;
    result.levels = std::move(levels);
    result.file = std::make_shared<const std::vector<std::uint8_t>>(wire::encode_learnt(**learnt));
  }
  return result;
}

}  // namespace hairnet::server
