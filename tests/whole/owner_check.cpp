#include "tests/whole/owner_check.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

namespace hairnet::whole {
namespace {

// The times of a log are cut to whole milliseconds, so a claim may seem older than it is, but not newer.
constexpr std::int64_t kLogStep_ns = 1'000'000;
// So many of the newest owners of a room are remembered; older ones are long over.
constexpr std::size_t kReignsMax = 16;

}  // namespace

void OwnerCheck::claimed(std::size_t server, const std::string& room, std::int64_t claim, std::int64_t at_ns) {
  Reigns& reigns = rooms_[room].reigns;
  const auto [at, is_new] = reigns.try_emplace(claim, Reign{.server = server, .claimed_ns = at_ns});
  if (!is_new && at->second.server != server)
    fault(fmt::format("two owners: servers {} and {} have both won claim {} of {}", at->second.server, server, claim,
                      room));
  if (reigns.size() > kReignsMax) reigns.erase(reigns.begin());
}

void OwnerCheck::received(std::size_t client, std::size_t server, const std::string& room, std::int64_t stamp_ns,
                          std::int64_t arrival_ns) {
  ++packets;
  Room& its = rooms_[room];
  // The newest claim of this server that is not younger than the frame is the one under which the frame was sent.
  auto at = its.reigns.end();
  for (auto each = its.reigns.begin(); each != its.reigns.end(); ++each)
    if (each->second.server == server && each->second.claimed_ns - kLogStep_ns <= stamp_ns) at = each;
  if (at == its.reigns.end())
    return fault(fmt::format("server {} sends frames of {}, which it has not claimed", server, room));
  const std::int64_t claim = at->first;
  Reign& reign = at->second;
  if (reign.first_ns == 0) {
    ++owners;
    reign.first_ns = reign.last_ns = stamp_ns;
  }
  reign.first_ns = std::min(reign.first_ns, stamp_ns);
  reign.last_ns = std::max(reign.last_ns, stamp_ns);
  check(room, its.reigns, at);
  for (auto newer = std::next(at); newer != its.reigns.end(); ++newer) {
    if (newer->second.first_ns == 0 || arrival_ns <= newer->second.first_ns) continue;
    ++in_flight;
    in_flight_ns_max = std::max(in_flight_ns_max, arrival_ns - newer->second.first_ns);
  }
  std::int64_t& newest = its.newest[client];
  if (claim < newest)
    fault(fmt::format("two owners: client {} gets frames of {} under claim {} of server {} after those of claim {}",
                      client, room, claim, server, newest));
  newest = std::max(newest, claim);
}

// Compares the changed reign with all others of the room: a lower claim must have sent its last frame before a higher
// one sends its first.
void OwnerCheck::check(const std::string& room, Reigns& reigns, Reigns::iterator changed) {
  const auto compare = [&](Reigns::value_type& older, const Reigns::value_type& newer) {
    if (older.second.first_ns == 0 || newer.second.first_ns == 0) return;
    const std::int64_t overlap_ns = older.second.last_ns - newer.second.first_ns;
    if (overlap_ns < 0) return;
    overlap_ns_max = std::max(overlap_ns_max, overlap_ns);
    if (std::exchange(older.second.is_faulty, true)) return;
    fault(fmt::format(
        "two owners: server {} (claim {}) sends frames of {} after server {} (claim {}) has begun, for {:.1f} ms",
        older.second.server, older.first, room, newer.second.server, newer.first,
        1e-6 * static_cast<double>(overlap_ns)));
  };
  for (auto each = reigns.begin(); each != reigns.end(); ++each) {
    if (each->first < changed->first) compare(*each, *changed);
    if (each->first > changed->first) compare(*changed, *each);
  }
}

std::optional<OwnerCheck::Owner> OwnerCheck::owner(const std::string& room) const {
  const auto found = rooms_.find(room);
  if (found == rooms_.end()) return std::nullopt;
  const Reigns& reigns = found->second.reigns;
  for (auto each = reigns.rbegin(); each != reigns.rend(); ++each) {
    const Reign& reign = each->second;
    if (reign.first_ns != 0) return Owner{reign.server, each->first, reign.claimed_ns, reign.first_ns, reign.last_ns};
  }
  return std::nullopt;
}

std::optional<std::int64_t> OwnerCheck::claimed_after(const std::string& room, std::int64_t after_ns) const {
  const auto found = rooms_.find(room);
  if (found == rooms_.end()) return std::nullopt;
  for (const auto& [claim, reign] : found->second.reigns)
    if (reign.claimed_ns > after_ns) return reign.claimed_ns;
  return std::nullopt;
}

std::optional<std::int64_t> OwnerCheck::frames_after(const std::string& room, std::int64_t after_ns) const {
  const auto found = rooms_.find(room);
  if (found == rooms_.end()) return std::nullopt;
  for (const auto& [claim, reign] : found->second.reigns)
    if (reign.claimed_ns > after_ns && reign.first_ns != 0) return reign.first_ns;
  return std::nullopt;
}

}  // namespace hairnet::whole
