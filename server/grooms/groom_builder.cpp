#include "server/grooms/groom_builder.hpp"

#include <fmt/format.h>

#include <utility>

#include "core/assert.hpp"
#include "core/levels/build.hpp"
#include "schema/wire/groom_file.hpp"
#include "server/grooms/build_pool.hpp"

namespace hairnet::server {
namespace {

using Outcome = GroomResult::Outcome;
using Fault = GroomResult::Fault;

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

GroomResult refused(const wire::GroomHash& hash, Fault fault, std::string detail) {
  HAIRNET_ASSERT(fault != Fault::none);
  GroomResult result;
  result.hash = hash;
  result.outcome = Outcome::refused;
  result.fault = fault;
  result.detail = std::move(detail);
  return result;
}

}  // namespace

GroomBuilder::GroomBuilder(const GroomBuilderDef& def) : def_(def), reads_(0), jobs_(def.queue_max), results_(0) {
  HAIRNET_ASSERT(def.queue_max > 0);
}

bool GroomBuilder::try_put(GroomJob& job) {
  if (!jobs_.try_put(job)) return false;
  wake();
  return true;
}

void GroomBuilder::read(const wire::GroomHash& groom) {
  reads_.put(groom);
  wake();
}

void GroomBuilder::refresh() {
  if (!def_.grooms) return;
  refresh_ = true;
  wake();
}

void GroomBuilder::wake() {
  if (on_job) on_job();
}

// What the store relies on, for each kind of result.
void GroomBuilder::check(const GroomResult& result) {
  HAIRNET_ASSERT((result.outcome == Outcome::refused) == (result.fault != Fault::none));
  HAIRNET_ASSERT((result.outcome == Outcome::ready) == (result.levels != nullptr));
  if (result.outcome == Outcome::building) HAIRNET_ASSERT(result.bytes);
}

void GroomBuilder::put(GroomResult result) {
  check(result);
  results_.put(std::move(result));
  if (on_result) on_result();
}

bool GroomBuilder::poll() {
  if (refresh_.exchange(false)) {
    def_.grooms->refresh();
    return true;
  }
  // In turn: uploads and reads do not wait for all of each other.
  is_reading_next_ = !is_reading_next_;
  return is_reading_next_ ? poll_read() || poll_job() : poll_job() || poll_read();
}

bool GroomBuilder::poll_read() {
  GroomResult result;
  if (!reads_.take(result.hash)) return false;
  result.outcome = Outcome::read;
  if (def_.grooms) result.bytes = def_.grooms->find(result.hash);
  put(std::move(result));
  return true;
}

bool GroomBuilder::poll_job() {
  GroomJob job;
  if (!jobs_.take(job)) return false;
  build(std::move(job));
  return true;
}

void GroomBuilder::build(GroomJob job) {
  const wire::GroomHash hash = job.hash;
  const bool uploaded = !job.chunks.empty();
  std::shared_ptr<const std::vector<std::uint8_t>> bytes;
  if (uploaded) {
    bytes = std::make_shared<const std::vector<std::uint8_t>>(joined(std::move(job.chunks)));
    if (wire::hash_groom(*bytes) != hash)
      return put(refused(hash, Fault::hash, "the bytes do not have the offered hash"));
  } else if (def_.grooms) {
    bytes = def_.grooms->find(hash);
  }
  GroomResult result;
  result.hash = hash;
  if (!bytes) {
    result.outcome = Outcome::absent;
    return put(std::move(result));
  }
  if (bytes->size() > def_.bytes_max)
    return put(refused(hash, Fault::size,
                       fmt::format("a groom of {} bytes; at most {} are taken", bytes->size(), def_.bytes_max)));
  const Result<Groom> groom = wire::decode_groom(*bytes, def_.limits);
  if (!groom) return put(refused(hash, Fault::invalid, groom.error()));
  if (groom->points.empty()) return put(refused(hash, Fault::invalid, "the groom has no strand points"));
  result.bytes = bytes;
  result.strand_count = groom->strand_count();
  put(result);
  result.bytes = nullptr;
  result.levels = levels_of(hash, *groom);
  if (!result.levels && cancelled_) return put(refused(hash, Fault::stopping, "the server is stopping"));
  if (!result.levels)
    return put(
        refused(hash, Fault::time,
                fmt::format("building it takes longer than {:g} s", static_cast<double>(def_.build_ns_max) * 1e-9)));
  result.outcome = Outcome::ready;
  put(std::move(result));
  // Cache only grooms that could be built, and only after the result is out.
  if (uploaded && def_.grooms) def_.grooms->put(hash, *bytes);
}

std::shared_ptr<const LevelSet> GroomBuilder::levels_of(const wire::GroomHash& hash, const Groom& groom) const {
  BuildPool pool(def_.thread_count);
  const ParallelFor parallel_for = [&pool](std::size_t count, const std::function<void(std::size_t)>& body) {
    pool.parallel_for(count, body);
  };
  if (def_.levels) {
    if (const std::shared_ptr<LevelSet> cached = def_.levels->find(hash)) {
      make_level_maps(groom, *cached, parallel_for);
      return cached;
    }
  }
  const std::int64_t begun_ns = def_.now_ns ? def_.now_ns() : 0;
  BuildCallbacks observer;
  observer.progress = [this, begun_ns](double, std::string_view) {
    return !cancelled_.load() && (!def_.now_ns || def_.now_ns() - begun_ns <= def_.build_ns_max);
  };
  std::shared_ptr<const LevelSet> levels = build_levels(groom, observer, nullptr, parallel_for);
  if (def_.levels && levels) def_.levels->put(hash, *levels);
  return levels;
}

}  // namespace hairnet::server
