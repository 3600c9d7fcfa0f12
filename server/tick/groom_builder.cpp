#include "server/tick/groom_builder.hpp"

#include <utility>

#include "core/build/build.hpp"
#include "schema/wire/groom_file.hpp"
#include "server/tick/build_pool.hpp"

namespace hairnet::server {
namespace {

std::vector<std::uint8_t> joined(std::vector<std::vector<std::uint8_t>> chunks) {
  std::size_t count = 0;
  for (const auto& chunk : chunks) count += chunk.size();
  std::vector<std::uint8_t> bytes;
  bytes.reserve(count);
  for (auto& chunk : chunks) {
    bytes.insert(bytes.end(), chunk.begin(), chunk.end());
    std::vector<std::uint8_t>().swap(chunk);
  }
  return bytes;
}

}  // namespace

GroomBuilder::GroomBuilder(const GroomLimits& limits, std::size_t queue_max, std::size_t thread_count,
                           LevelCache* cache)
    : limits_(limits),
      thread_count_(thread_count),
      cache_(cache),
      jobs_(queue_max),
      results_(0) {}

bool GroomBuilder::try_put(GroomJob& job) {
  if (!jobs_.try_put(job)) return false;
  if (on_job) on_job();
  return true;
}

bool GroomBuilder::poll() {
  GroomJob job;
  if (!jobs_.take(job)) return false;
  GroomResult begun;
  begun.hash = job.hash;
  results_.put(std::move(begun));
  if (on_result) on_result();
  results_.put(build(std::move(job)));
  if (on_result) on_result();
  return true;
}

GroomResult GroomBuilder::build(GroomJob job) const {
  GroomResult result;
  result.hash = job.hash;
  result.state = wire::GroomState::refused;
  auto bytes = std::make_shared<const std::vector<std::uint8_t>>(joined(std::move(job.chunks)));
  if (wire::hash_groom(*bytes) != job.hash) {
    result.reason = wire::ErrorReason::groom_hash_mismatch;
    result.detail = "the bytes do not have the offered hash";
    return result;
  }
  Result<Groom> groom = wire::decode_groom(*bytes, limits_);
  result.reason = wire::ErrorReason::groom_invalid;
  if (!groom) {
    result.detail = groom.error();
    return result;
  }
  if (groom->points.empty()) {
    result.detail = "the groom has no strand points";
    return result;
  }
  result.levels = levels_of(job.hash, *groom);
  if (!result.levels) {
    result.detail = "the server is stopping";
    return result;
  }
  result.reason = wire::ErrorReason::none;
  result.state = wire::GroomState::ready;
  result.bytes = std::move(bytes);
  return result;
}

std::shared_ptr<const LevelSet> GroomBuilder::levels_of(const wire::GroomHash& hash, const Groom& groom) const {
  BuildPool pool(thread_count_);
  const ParallelFor parallel_for = [&pool](std::size_t count, const std::function<void(std::size_t)>& body) {
    pool.parallel_for(count, body);
  };
  if (cache_) {
    if (const std::shared_ptr<LevelSet> cached = cache_->find(hash)) {
      connect_levels(groom, *cached, parallel_for);
      return cached;
    }
  }
  BuildObserver observer;
  observer.progress = [this](double, std::string_view) { return !cancelled_.load(); };
  std::shared_ptr<const LevelSet> levels = build_levels(groom, observer, nullptr, parallel_for);
  if (cache_ && levels) cache_->put(hash, *levels);
  return levels;
}

}  // namespace hairnet::server
