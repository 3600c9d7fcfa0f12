#pragma once

#include <algorithm>
#include <cstdint>
#include <map>
#include <optional>
#include <utility>
#include <vector>

#include "server/exchange/character_key.hpp"
#include "server/exchange/groom_service.hpp"

namespace hairnet::server {

// A subject with all its sessions, or a session that belongs to no subject: one party that takes turns with others. One
// of the two numbers is zero.
using Sharer = std::pair<std::uint32_t, SessionId>;

// Knows the share of each session, and who shares with whom: all sessions of a subject count as one sharer, so that
// more connections give no larger share. I/O thread.
class GroomShares {
 public:
  void open(SessionId session, const GroomShare& share) { shares_[session] = share; }
  // A session that was never opened shares with none.
  void open_alone(SessionId session) { shares_.try_emplace(session); }
  void close(SessionId session) { shares_.erase(session); }

  [[nodiscard]] bool has(SessionId session) const { return shares_.contains(session); }
  // True while a session of the sharer is open.
  [[nodiscard]] bool has_any(const Sharer& sharer) const {
    return std::ranges::any_of(shares_, [&](const auto& s) { return sharer_of(s.first) == sharer; });
  }
  [[nodiscard]] GroomShare share_of(SessionId session) const {
    const auto share = shares_.find(session);
    return share == shares_.end() ? GroomShare{} : share->second;
  }
  [[nodiscard]] Sharer sharer_of(SessionId session) const {
    const std::uint32_t subject = share_of(session).subject;
    // One of the two is zero: a subject, or a session that shares with none.
    return {subject, subject == 0 ? session : 0};
  }
  [[nodiscard]] std::vector<SessionId> sessions_of_holder(std::uint32_t token_holder) const {
    std::vector<SessionId> sessions;
    for (const auto& [session, share] : shares_) {
      if (share.token_holder == token_holder) sessions.push_back(session);
    }
    return sessions;
  }
  // Returns the sharer that holds most, which has to give something up so that the session can hold `more`. Returns
  // nullopt when the session's sharer would then hold as much itself.
  [[nodiscard]] std::optional<Sharer> sharer_with_most(std::map<Sharer, std::uint64_t> held, SessionId session,
                                                       std::uint64_t more) const {
    const auto most = std::ranges::max_element(held, {}, [](const auto& h) { return h.second; });
    if (most == held.end() || most->second <= held[sharer_of(session)] + more) return std::nullopt;
    return most->first;
  }

 private:
  std::map<SessionId, GroomShare> shares_;
};

}  // namespace hairnet::server
