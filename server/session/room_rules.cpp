#include "server/session/room_rules.hpp"

namespace hairnet::server {

bool RoomRules::ban(const std::string& room, const std::string& subject, std::int64_t until_ns, std::int64_t now_ns,
                    std::size_t entries_max) {
  // Such a ban ends an earlier one, so it needs no place.
  if (until_ns <= now_ns) {
    bans_.erase({room, subject});
    return true;
  }
  if (!bans_.contains({room, subject})) {
    // Bans that have ended are removed once a second only; a full set looks again before it refuses.
    if (entry_count() >= entries_max) expire(now_ns);
    if (entry_count() >= entries_max) return false;
  }
  bans_[{room, subject}] = until_ns;
  return true;
}

bool RoomRules::mute(const std::string& room, const std::string& subject, std::size_t entries_max) {
  // A mute that exists already needs no place, so it succeeds in a full set too.
  if (entry_count() >= entries_max) return is_muted(room, subject);
  mutes_.emplace(room, subject);
  return true;
}

bool RoomRules::lock(const std::string& room, std::size_t entries_max) {
  if (entry_count() >= entries_max) return is_locked(room);
  locks_.insert(room);
  return true;
}

bool RoomRules::is_banned(const std::string& room, const std::string& subject, std::int64_t now_ns) const {
  if (bans_.empty()) return false;
  const auto found = bans_.find({room, subject});
  return found != bans_.end() && now_ns < found->second;
}

bool RoomRules::has_mutes(const std::string& room) const {
  // Pairs are ordered by room, then by subject: the mutes of a room begin here, and the empty text is the first
  // subject.
  const auto first = mutes_.lower_bound({room, ""});
  return first != mutes_.end() && first->first == room;
}

RoomRules::OfRoom RoomRules::of_room(const std::string& room, std::int64_t now_ns) const {
  OfRoom rules;
  for (auto ban = bans_.lower_bound({room, ""}); ban != bans_.end() && ban->first.first == room; ++ban)
    if (now_ns < ban->second) rules.bans.emplace_back(ban->first.second, ban->second);
  for (auto mute = mutes_.lower_bound({room, ""}); mute != mutes_.end() && mute->first == room; ++mute)
    rules.mutes.push_back(mute->second);
  rules.is_locked = is_locked(room);
  return rules;
}

void RoomRules::forget(const std::string& room) {
  std::erase_if(bans_, [&](const auto& ban) { return ban.first.first == room; });
  std::erase_if(mutes_, [&](const Person& muted) { return muted.first == room; });
  std::erase_if(returning_, [&](const auto& one) { return one.first.first == room; });
  locks_.erase(room);
  ends_ns_.erase(room);
}

std::size_t RoomRules::replace(const std::string& room, const OfRoom& rules, std::int64_t now_ns,
                               std::size_t entries_max) {
  forget(room);
  std::size_t left_out = 0;
  if (rules.is_locked) left_out += lock(room, entries_max) ? 0 : 1;
  for (const std::string& muted : rules.mutes) left_out += mute(room, muted, entries_max) ? 0 : 1;
  for (const auto& [subject, until_ns] : rules.bans)
    left_out += ban(room, subject, until_ns, now_ns, entries_max) ? 0 : 1;
  if (rules.is_locked)
    for (const std::string& subject : rules.returning) returning_[{room, subject}] = rules.return_until_ns;
  return left_out;
}

bool RoomRules::may_return(const std::string& room, const std::string& subject, std::int64_t now_ns) const {
  const auto found = returning_.find({room, subject});
  return found != returning_.end() && now_ns < found->second;
}

void RoomRules::close_room(const std::string& room, std::int64_t ends_ns) {
  // Bans have their own time, so an empty room without lock and mutes needs no end.
  if (is_locked(room) || has_mutes(room)) ends_ns_[room] = ends_ns;
}

void RoomRules::expire(std::int64_t now_ns) {
  std::erase_if(bans_, [now_ns](const auto& ban) { return ban.second <= now_ns; });
  std::erase_if(returning_, [now_ns](const auto& one) { return one.second <= now_ns; });
  std::erase_if(ends_ns_, [this, now_ns](const auto& room) {
    if (now_ns < room.second) return false;
    locks_.erase(room.first);
    std::erase_if(mutes_, [&room](const Person& muted) { return muted.first == room.first; });
    return true;
  });
}

}  // namespace hairnet::server
