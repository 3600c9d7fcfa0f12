#include "server/grooms/groom_builder.hpp"

#include <fmt/format.h>

#include <new>
#include <utility>

#include "core/assert.hpp"
#include "core/levels/build.hpp"
#include "core/levels/build_estimate.hpp"
#include "core/modes/make_modes.hpp"
#include "schema/wire/basis_file.hpp"
#include "schema/wire/groom_file.hpp"
#include "schema/wire/learnt_file.hpp"
#include "schema/wire/packing.hpp"
#include "server/grooms/build_pool.hpp"
#include "server/threading/memory_reserve.hpp"

namespace hairnet::server {
namespace {

using Outcome = GroomResult::Outcome;

// Joins the pieces of an upload into one file.
std::vector<std::uint8_t> joined(std::vector<std::vector<std::uint8_t>> chunks) {
  std::size_t count = 0;
  for (const auto& chunk : chunks) count += chunk.size();
  std::vector<std::uint8_t> bytes;
  bytes.reserve(count);
  for (auto& chunk : chunks) {
    bytes.insert(bytes.end(), chunk.begin(), chunk.end());
    // Each piece is freed once it is copied, so that a large groom is not in memory twice.
    std::vector<std::uint8_t>().swap(chunk);
  }
  return bytes;
}

GroomResult refused(BuildError error, std::string detail) {
  HAIRNET_ASSERT(error != BuildError::none);
  GroomResult result;
  result.outcome = Outcome::refused;
  result.error = error;
  result.detail = std::move(detail);
  return result;
}

}  // namespace

// The queues have no bound of their own (0), because only put() is used: the number of grooms, or of jobs, bounds them.
GroomBuilder::GroomBuilder(const GroomBuilderDef& def) : def_(def), reads_(0), learnt_(0), jobs_(0), results_(0) {
  HAIRNET_ASSERT(def.build_levels);
}

void GroomBuilder::put(GroomJob job) {
  HAIRNET_ASSERT(job.number > 0);
  jobs_.put(std::move(job));
  wake();
}

void GroomBuilder::read(const wire::GroomHash& groom) {
  reads_.put(groom);
  wake();
}

void GroomBuilder::cache(const wire::GroomHash& groom, std::shared_ptr<const LevelSet> levels) {
  HAIRNET_ASSERT(levels);
  if (!def_.levels) return;
  learnt_.put({groom, std::move(levels)});
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

// Asserts what GroomStore relies on, for each kind of result.
void GroomBuilder::check(const GroomResult& result) {
  HAIRNET_ASSERT((result.outcome == Outcome::refused) == (result.error != BuildError::none));
  HAIRNET_ASSERT((result.outcome == Outcome::ready) == (result.levels != nullptr));
  if (result.outcome == Outcome::building) HAIRNET_ASSERT(result.bytes);
}

void GroomBuilder::give(GroomResult result) {
  check(result);
  results_.put(std::move(result));
  if (on_result) on_result();
}

bool GroomBuilder::poll() {
  // A refresh comes first: it is short, and it may find the file or levels that the next job needs.
  if (refresh_.exchange(false)) {
    def_.grooms->refresh();
    return true;
  }
  if (Learnt learnt; learnt_.take(learnt)) {
    def_.levels->put(learnt.groom, *learnt.levels);
    return true;
  }
  // Jobs and reads take turns, so that neither uploads nor downloads wait for all of the other.
  is_reading_next_ = !is_reading_next_;
  return is_reading_next_ ? poll_read() || poll_job() : poll_job() || poll_read();
}

bool GroomBuilder::poll_read() {
  GroomResult result;
  if (!reads_.take(result.hash)) return false;
  result.outcome = Outcome::read;
  if (def_.grooms) {
    try {
      // Allocations in this scope may fail with std::bad_alloc instead of taking the server's reserve
      // (threading/memory_reserve.hpp): one groom is no reason to spend it.
      const MemoryReserve::MayFail may_fail;
      result.bytes = def_.grooms->find(result.hash);
    } catch (const std::bad_alloc&) {
      result.bytes = nullptr;
    }
  }
  give(std::move(result));
  return true;
}

bool GroomBuilder::poll_job() {
  GroomJob job;
  if (!jobs_.take(job)) return false;
  do_job(std::move(job));
  return true;
}

void GroomBuilder::do_job(GroomJob job) {
  const std::uint64_t number = job.number;
  const wire::GroomHash hash = job.hash;
  const std::int64_t begun_ns = clock_ns();
  GroomResult result;
  try {
    const MemoryReserve::MayFail may_fail;
    result = build(std::move(job));
  } catch (const std::bad_alloc&) {
    // A lack of memory is the server's error and not the groom's, so BuildTurns tries the build again.
    result = refused(BuildError::server, "the server has no memory left for its build");
  }
  result.job = number;
  result.hash = hash;
  result.build_ns = clock_ns() - begun_ns;
  give(std::move(result));
}

GroomResult GroomBuilder::build(GroomJob job) {
  const bool is_uploaded = job.bytes || !job.chunks.empty();
  GroomResult building;
  building.job = job.number;
  building.hash = job.hash;
  if (job.bytes) {
    building.bytes = std::move(job.bytes);
  } else if (!job.chunks.empty()) {
    building.bytes = std::make_shared<const std::vector<std::uint8_t>>(joined(std::move(job.chunks)));
    HAIRNET_VALIDATE(wire::hash_groom(*building.bytes) == job.hash);
  } else if (def_.grooms) {
    building.bytes = def_.grooms->find(job.hash);
  }
  // The folder has lost the file since it was listed. The store then asks a session for the bytes.
  if (!building.bytes) {
    building.outcome = Outcome::absent;
    return building;
  }
  const std::shared_ptr<const std::vector<std::uint8_t>> file = building.bytes;
  if (file->size() > def_.bytes_max)
    return refused(BuildError::size,
                   fmt::format("a groom of {} bytes; at most {} are taken", file->size(), def_.bytes_max));
  // A packed groom may be small and unpack to gigabytes, so the unpacked size is checked before anything is unpacked.
  if (const std::size_t unpacked_bytes = wire::unpacked_bytes(*file, wire::kPackedGroom);
      unpacked_bytes > def_.bytes_max)
    return refused(BuildError::size, fmt::format("a groom of {} bytes when unpacked; at most {} are taken",
                                                 unpacked_bytes, def_.bytes_max));
  const Result<Groom> groom = wire::decode_groom(*file, def_.build.groom);
  if (!groom) return refused(BuildError::invalid, groom.error());
  if (groom->points.empty()) return refused(BuildError::invalid, "the groom has no strand points");
  building.strand_count = groom->strand_count();
  // The I/O thread gets this result before the long build begins, and checks the size and the strands against the
  // limits of the groom's users.
  give(std::move(building));
  GroomResult result = build(job, *file, *groom);
  // Only grooms that could be built are cached: a file that no server can use would cost each restart a build.
  if (result.levels && is_uploaded && def_.grooms) def_.grooms->put(job.hash, *file);
  return result;
}

GroomResult GroomBuilder::build(const GroomJob& job, const std::vector<std::uint8_t>& file, const Groom& groom) const {
  const std::int64_t begun_ns = clock_ns();
  const GoesOn goes_on = [&] {
    if (cancelled_ || dropped_ == job.number) return BuildError::dropped;
    // The time counts from the build's begin, after the file was read and decoded.
    return clock_ns() - begun_ns > def_.build.ns_max ? BuildError::time : BuildError::none;
  };
  const LevelBuild build = levels_of(job, file, groom, goes_on);
  switch (build.error) {
    case BuildError::none:
      break;
    case BuildError::dropped:
      return refused(build.error, cancelled_ ? "the server is stopping" : "nobody uses the groom any more");
    case BuildError::time:
      return refused(build.error, fmt::format("building it takes longer than {:g} s",
                                              static_cast<double>(def_.build.ns_max) * 1e-9));
    default:
      return refused(build.error, build.detail);
  }
  GroomResult result;
  result.outcome = Outcome::ready;
  result.levels = build.levels;
  HAIRNET_ASSERT(build.levels->modes);
  const Level& finest = (*build.levels)[LevelIndex::high];
  result.basis = std::make_shared<const std::vector<std::uint8_t>>(
      wire::encode_basis(finest.geometry, build.levels->modes->basis, *finest.skin));
  if (build.levels->learnt)
    result.learnt = std::make_shared<const std::vector<std::uint8_t>>(wire::encode_learnt(*build.levels->learnt));
  return result;
}

LevelBuild GroomBuilder::levels_of(const GroomJob& job, const std::vector<std::uint8_t>& file, const Groom& groom,
                                   const GoesOn& goes_on) const {
  if (def_.levels) {
    std::shared_ptr<LevelSet> cached = def_.levels->find(job.hash);
    if (cached && cached->modes) {
      BuildPool pool(def_.build.thread_count);
      make_level_maps(groom, *cached, [&pool](std::size_t count, const std::function<void(std::size_t)>& body) {
        pool.parallel_for(count, body);
      });
      return {std::move(cached), BuildError::none, {}};
    }
  }
  // The estimate costs little beside a build, and refuses what would be killed for its memory after a long time. It
  // comes after the cache: cached levels need no build.
  const BuildEstimate estimate = estimate_build(groom);
  if (estimate.memory_bytes > def_.build.memory_bytes_max)
    return {nullptr, BuildError::memory,
            fmt::format("its {} pieces of hair between lattice planes need about {} MiB of memory; a build may take {}",
                        estimate.spring_count, estimate.memory_bytes >> 20, def_.build.memory_bytes_max >> 20)};
  LevelBuild build = def_.build_levels(def_.build, job.hash, file, groom, goes_on);
  HAIRNET_ASSERT((build.levels == nullptr) == (build.error != BuildError::none));
  if (def_.levels && build.levels) def_.levels->put(job.hash, *build.levels);
  return build;
}

}  // namespace hairnet::server
