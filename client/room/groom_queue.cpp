#include "client/room/groom_queue.hpp"

#include <algorithm>

namespace hairnet::room {
namespace {

// A program's first report of heights comes often before its camera is placed, so two are awaited. A program that sends
// no reports waits 0.6 s and four calls: calls count too, because a program that loads may call rarely at first.
constexpr int kReports = 2, kWaitCalls = 4;
constexpr std::int64_t kWait_ns = 600'000'000;

}  // namespace

void GroomQueue::finish(const wire::GroomHash& groom) {
  waiting_.erase(groom);
  if (current_ == groom) current_.reset();
}

void GroomQueue::set_heights(std::span<const std::pair<wire::GroomHash, float>> heights) {
  heights_.clear();
  // The largest head with a groom decides when the groom is fetched.
  for (const auto& [groom, height] : heights) heights_[groom] = std::max(height, heights_[groom]);
  if (!heights_.empty() && reports_ < kReports) ++reports_;
}

std::optional<wire::GroomHash> GroomQueue::next(std::int64_t now_ns, const std::optional<wire::GroomHash>& first,
                                                bool only_first) {
  if (current_ || waiting_.empty()) return {};
  const bool has_first = first && waiting_.contains(*first);
  if (only_first && !has_first) return {};
  // The wait begins with the first groom, and not with the room, which may be empty for long.
  if (!begun_ns_) begun_ns_ = now_ns;
  if (calls_ < kWaitCalls) ++calls_;
  const std::optional<wire::GroomHash> best = has_first ? first : largest(now_ns - *begun_ns_);
  if (best) waiting_.erase(*best);
  current_ = best;
  return best;
}

std::optional<wire::GroomHash> GroomQueue::largest(std::int64_t waited_ns) const {
  if (reports_ < kReports && (waited_ns < kWait_ns || calls_ < kWaitCalls)) return {};
  const auto height = [this](const wire::GroomHash& groom) {
    const auto found = heights_.find(groom);
    return found == heights_.end() ? 0 : found->second;
  };
  return *std::ranges::max_element(waiting_, {}, height);
}

}  // namespace hairnet::room
