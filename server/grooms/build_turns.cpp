#include "server/grooms/build_turns.hpp"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <utility>

#include "core/assert.hpp"
#include "server/telemetry/log_hash.hpp"
#include "server/telemetry/log_text.hpp"

namespace hairnet::server {
namespace {

using wire::ErrorReason;

// Returns the reason that clients get for a build error, and the counter of such refusals.
std::pair<ErrorReason, Counter*> reason_of(BuildError error, GroomCounters& counters) {
  switch (error) {
    case BuildError::size:
      return {ErrorReason::limit_exceeded, &counters.grooms_refused_size};
    case BuildError::time:
      return {ErrorReason::limit_exceeded, &counters.grooms_refused_build_time};
    case BuildError::memory:
      return {ErrorReason::limit_exceeded, &counters.grooms_refused_build_memory};
    case BuildError::invalid:
      return {ErrorReason::groom_invalid, &counters.grooms_refused_invalid};
    case BuildError::crash:
      return {ErrorReason::groom_build_failed, &counters.grooms_refused_build_crash};
    case BuildError::server:
      return {ErrorReason::groom_build_failed, &counters.grooms_refused_server};
    case BuildError::none:
    case BuildError::dropped:
      break;
  }
  return {ErrorReason::groom_build_failed, &counters.grooms_refused_invalid};
}

}  // namespace

void BuildTurns::queue(const wire::GroomHash& groom, SessionId owner, std::vector<std::vector<std::uint8_t>> chunks,
                       std::int64_t now_ns) {
  const auto [found, is_new] = builds_.try_emplace(groom);
  HAIRNET_ASSERT(is_new);
  Build& build = found->second;
  build.owner = owner;
  build.order = ++orders_;
  for (const auto& chunk : chunks) build.bytes += chunk.size();
  build.chunks = std::move(chunks);
  bytes_ += build.bytes;
  feed(now_ns);
}

void BuildTurns::erase(const wire::GroomHash& groom) {
  const auto build = builds_.find(groom);
  if (build == builds_.end()) return;
  if (build->second.job != 0) builder_->drop(build->second.job);
  remove(build);
}

void BuildTurns::remove(Builds::const_iterator build) {
  bytes_ -= build->second.bytes;
  builds_.erase(build);
}

void BuildTurns::poll(std::int64_t now_ns) {
  end_turn(now_ns);
  feed(now_ns);
#ifdef HAIRNET_VALIDATE_ON
  std::size_t bytes = 0, at_builder = 0;
  for (const auto& [groom, build] : builds_) {
    bytes += build.bytes;
    at_builder += build.job == 0 ? 0 : 1;
    HAIRNET_ASSERT(!build.since_ns || (build.job != 0 && build.file));
    HAIRNET_ASSERT(build.chunks.empty() || build.job == 0);
  }
  HAIRNET_ASSERT(bytes == bytes_);
  HAIRNET_ASSERT(at_builder <= (is_builder_busy_ ? 1 : 0));
#endif
}

void BuildTurns::feed(std::int64_t now_ns) {
  // The builder has one job at a time, so that the next groom is chosen only when the builder is free, by the times
  // that the builds of all sharers have taken by then.
  if (is_builder_busy_) return;
  const auto found = next(now_ns);
  if (found == builds_.end()) return;
  is_builder_busy_ = true;
  Build& build = builds_.at(found->first);
  build.job = ++jobs_;
  builder_->put({jobs_, found->first, std::exchange(build.chunks, {}), build.file});
}

BuildTurns::Turn BuildTurns::turn_of(const Build& build) const {
  const auto taken = build_ns_.find(shares_->sharer_of(build.owner));
  // Tuples compare from left to right: whether the owner has left, then the time, then the order of arrival.
  return {!shares_->has(build.owner), taken == build_ns_.end() ? 0 : taken->second, build.order};
}

BuildTurns::Builds::const_iterator BuildTurns::next(std::int64_t now_ns) const {
  auto next = builds_.end();
  for (auto build = builds_.begin(); build != builds_.end(); ++build) {
    // A build that has failed by the server's error waits until again_ns; others go first.
    if (build->second.job != 0 || build->second.again_ns > now_ns) continue;
    if (next == builds_.end() || turn_of(build->second) < turn_of(next->second)) next = build;
  }
  return next;
}

void BuildTurns::end_turn(std::int64_t now_ns) {
  const auto built = std::ranges::find_if(builds_, [](const auto& b) { return b.second.since_ns.has_value(); });
  if (built == builds_.end() || built->second.gives_way) return;
  Build& build = built->second;
  const std::int64_t taken_ns = now_ns - *build.since_ns;
  if (taken_ns < build.turn_ns) return;
  // The time so far is charged before the comparison, or an endless build would count as nothing until it ends.
  charge(build, taken_ns);
  const auto waiting = next(now_ns);
  // No sharer with less time waits, so the build goes on: to end it would only lose its work.
  if (waiting == builds_.end() || turn_of(waiting->second) >= turn_of(build)) return;
  build.gives_way = true;
  builder_->drop(build.job);
}

void BuildTurns::charge(Build& build, std::int64_t taken_ns) {
  // Only the part since the last charge counts. An owner who has left has no account any more.
  if (taken_ns <= build.charged_ns || !shares_->has(build.owner)) return;
  build_ns_[shares_->sharer_of(build.owner)] += taken_ns - build.charged_ns;
  build.charged_ns = taken_ns;
}

BuildTurns::Progress BuildTurns::take(const GroomResult& result, std::int64_t now_ns) {
  const bool has_ended = result.outcome != GroomResult::Outcome::building;
  if (has_ended) is_builder_busy_ = false;
  const auto found = builds_.find(result.hash);
  // A dropped groom may have been offered again while its former build was ending: the numbers of the jobs tell them
  // apart.
  if (found == builds_.end() || found->second.job != result.job) return Progress::none;
  Build& build = found->second;
  if (!has_ended) {
    HAIRNET_ASSERT(!build.since_ns && result.bytes);
    build.since_ns = now_ns;
    if (build.turn_ns == 0) build.turn_ns = limits_.build_turn_ns;
    build.file = result.bytes;
    bytes_ += build.file->size() - build.bytes;
    build.bytes = build.file->size();
    return Progress::building;
  }
  build.job = 0;
  build.since_ns.reset();
  charge(build, result.build_ns);
  build.charged_ns = 0;
  // A build may end by itself just when it was told to give way; then its result counts.
  if (std::exchange(build.gives_way, false) && result.error == BuildError::dropped) {
    counters_->builds_interrupted.add();
    build.turn_ns *= 2;
    return Progress::queued;
  }
  if (result.error == BuildError::server && try_again(result, build, now_ns)) return Progress::queued;
  remove(found);
  return Progress::ended;
}

bool BuildTurns::try_again(const GroomResult& failed, Build& build, std::int64_t now_ns) {
  counters_->builds_failed.add();
  // 1, 2, 4 s with the usual limits: a machine that is short of memory or processes gets time to recover.
  build.again_ns = now_ns + (limits_.build_again_ns << build.failed_count);
  // Without the file in memory there is nothing to try again with.
  const bool may_try = ++build.failed_count < limits_.build_count_max && build.file;
  spdlog::warn("event=build_failed groom={} detail={} tries={} again={}", log_hash(failed.hash),
               log_text(failed.detail), build.failed_count, may_try);
  return may_try;
}

Refused BuildTurns::refusal_of(const GroomResult& result) {
  const auto [reason, counter] = reason_of(result.error, *counters_);
  counter->add();
  if (reason != ErrorReason::groom_build_failed) return {reason, result.detail};
  return {reason, fmt::format("the server could not build it, by an error of its own: {}; offer it again in a while",
                              result.detail)};
}

bool BuildTurns::is_idle(std::int64_t now_ns) const {
  return !is_builder_busy_ && next(now_ns) == builds_.end();
}

bool BuildTurns::is_full() const {
  const auto count = std::ranges::count_if(builds_, [](const auto& b) { return waits_with_file(b.second); });
  return static_cast<std::size_t>(count) >= limits_.build_queue_max;
}

std::optional<wire::GroomHash> BuildTurns::to_drop_for(SessionId session) const {
  std::map<Sharer, std::uint64_t> waiting;
  for (const auto& [groom, build] : builds_) {
    if (waits_with_file(build)) ++waiting[shares_->sharer_of(build.owner)];
  }
  const std::optional<Sharer> most = shares_->sharer_with_most(std::move(waiting), session, 1);
  auto newest = builds_.end();
  for (auto build = builds_.begin(); most && build != builds_.end(); ++build) {
    if (!waits_with_file(build->second) || shares_->sharer_of(build->second.owner) != *most) continue;
    if (newest == builds_.end() || build->second.order > newest->second.order) newest = build;
  }
  return newest == builds_.end() ? std::nullopt : std::optional(newest->first);
}

}  // namespace hairnet::server
