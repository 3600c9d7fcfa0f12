#include "server/session/room_rules.hpp"

namespace hairnet::server {

bool RoomRules::ban(const std::string& room, const std::string& subject, std::int64_t until_ns, std::int64_t now_ns,
                    std::size_t entries_max) {
  if (until_ns <= now_ns) {
    bans_.erase({room, subject});
    return true;
  }
  if (!bans_.contains({room, subject})) {
    if (entry_count() >= entries_max) expire(now_ns);
    if (entry_count() >= entries_max) return false;
  }
  bans_[{room, subject}] = until_ns;
  return true;
}

bool RoomRules::mute(const std::string& room, const std::string& subject, std::size_t entries_max) {
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
  const auto first = mutes_.lower_bound({room, ""});
  return first != mutes_.end() && first->first == room;
}

void RoomRules::close_room(const std::string& room, std::int64_t ends_ns) {
  if (is_locked(room) || has_mutes(room)) ends_ns_[room] = ends_ns;
}

void RoomRules::expire(std::int64_t now_ns) {
  std::erase_if(bans_, [now_ns](const auto& ban) { return ban.second <= now_ns; });
  std::erase_if(ends_ns_, [this, now_ns](const auto& room) {
    if (now_ns < room.second) return false;
    locks_.erase(room.first);
    std::erase_if(mutes_, [&room](const Person& muted) { return muted.first == room.first; });
    return true;
  });
}

}  // namespace hairnet::server
