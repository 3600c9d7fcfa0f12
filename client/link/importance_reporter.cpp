#include "client/link/importance_reporter.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/assert.hpp"

namespace hairnet::link {
namespace {

// The server assumes this height for a member of which nothing was reported (PROTOCOL.md, Levels of detail).
constexpr float kUnreportedHeight = 0.25f;

bool differs(const wire::MemberImportance& a, const wire::MemberImportance& b) {
  const float most = std::max(std::abs(a.screen_height), std::abs(b.screen_height));
  return a.in_view != b.in_view || std::abs(a.screen_height - b.screen_height) > ImportanceReporter::kChange * most;
}

}  // namespace

void ImportanceReporter::report(std::span<const wire::MemberImportance> members) {
  for (const wire::MemberImportance& m : members) {
    const auto [found, is_new] = members_.try_emplace(m.member);
    Reported& reported = found->second;
    reported.now = m;
    reported.has_left = false;
    // A change is measured from what was sent, and not from the last report: many small ones add up to one that is
    // sent.
    reported.due = reported.due || differs(reported.now, reported.sent);
    any_due_ = any_due_ || reported.due;
  }
}

void ImportanceReporter::forget(std::uint32_t member) {
  const auto found = members_.find(member);
  if (found == members_.end()) return;
  Reported& reported = found->second;
  // The server has heard nothing of this member, so nothing has to be taken back.
  if (!reported.is_sent) {
    members_.erase(found);
    return;
  }
  // The number may belong to another member soon, which the server would weigh by the old value (PROTOCOL.md, Levels of
  // detail).
  reported.now = {member, kUnreportedHeight, true};
  reported.due = reported.has_left = any_due_ = true;
}

void ImportanceReporter::forget_all() {
  members_.clear();
  any_due_ = false;
}

void ImportanceReporter::resend_all() {
  for (auto& [member, reported] : members_) reported.due = true;
  any_due_ = !members_.empty();
}

std::optional<wire::ReportImportance> ImportanceReporter::take(std::int64_t now_ns) {
  if (now_ns < due_ns()) return std::nullopt;
  wire::ReportImportance message;
  any_due_ = false;
  for (auto next = members_.begin(); next != members_.end();) {
    const auto found = next++;
    Reported& reported = found->second;
    if (!reported.due) continue;
    // The rest goes with the next report.
    if (message.members.size() == wire::kMembersPerMessageMax) {
      any_due_ = true;
      break;
    }
    message.members.push_back(reported.now);
    reported.sent = reported.now;
    reported.due = false;
    reported.is_sent = true;
    if (reported.has_left) members_.erase(found);
  }
  HAIRNET_ASSERT(message.members.size() <= wire::kMembersPerMessageMax);
  HAIRNET_VALIDATE(any_due_ || std::ranges::none_of(members_, [](const auto& m) { return m.second.due; }));
  next_ns_ = now_ns + kInterval_ns;
  if (message.members.empty()) return std::nullopt;
  return message;
}

std::int64_t ImportanceReporter::due_ns() const {
  return any_due_ ? next_ns_ : std::numeric_limits<std::int64_t>::max();
}

}  // namespace hairnet::link
