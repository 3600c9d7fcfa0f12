#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <set>
#include <string>
#include <utility>
#include <vector>

namespace hairnet::server {

// What moderators have decided about rooms: who is banned or muted there, by Subject::name, and which rooms are locked.
// A ban lasts its time. Mutes and a lock last while the room exists. It does not end sessions: moderation.cpp does. I/O
// thread.
class RoomRules {
 public:
  // `entries_max`: of bans, mutes and locks of all rooms together. ban(), mute() and lock() return false, and change
  // nothing, when they need one more.

  // Bans the subject until then, instead of until the end of an earlier ban; at `now_ns` or before: ends that ban.
  [[nodiscard]] bool ban(const std::string& room, const std::string& subject, std::int64_t until_ns,
                         std::int64_t now_ns, std::size_t entries_max);
  [[nodiscard]] bool mute(const std::string& room, const std::string& subject, std::size_t entries_max);
  void unmute(const std::string& room, const std::string& subject) { mutes_.erase({room, subject}); }
  [[nodiscard]] bool lock(const std::string& room, std::size_t entries_max);
  void unlock(const std::string& room) { locks_.erase(room); }

  [[nodiscard]] bool is_banned(const std::string& room, const std::string& subject, std::int64_t now_ns) const;
  [[nodiscard]] bool is_muted(const std::string& room, const std::string& subject) const {
    return !mutes_.empty() && mutes_.contains({room, subject});
  }
  [[nodiscard]] bool is_locked(const std::string& room) const { return locks_.contains(room); }
  [[nodiscard]] std::size_t entry_count() const { return bans_.size() + mutes_.size() + locks_.size(); }

  // What is decided of one room.
  struct OfRoom {
    // Holds each subject and when its ban ends.
    std::vector<std::pair<std::string, std::int64_t>> bans;
    std::vector<std::string> mutes;
    bool is_locked = false;
    // They may enter a locked room until return_until_ns.
    std::vector<std::string> returning;
    std::int64_t return_until_ns = 0;
  };
  [[nodiscard]] OfRoom of_room(const std::string& room, std::int64_t now_ns) const;
  // Takes the place of all that was decided about the room. Returns how many bans, mutes and locks are left out beyond
  // `entries_max`. The lock and the mutes come before the bans, so that bans are left out first.
  std::size_t replace(const std::string& room, const OfRoom& rules, std::int64_t now_ns, std::size_t entries_max);
  // Forgets all that was decided about the room, bans included.
  void forget(const std::string& room);
  [[nodiscard]] bool may_return(const std::string& room, const std::string& subject, std::int64_t now_ns) const;

  // A session has entered: mutes and lock stay.
  void open_room(const std::string& room) { ends_ns_.erase(room); }
  // Nobody is left, and the room ends at `ends_ns` unless somebody enters before.
  void close_room(const std::string& room, std::int64_t ends_ns);
  // Forgets bans that have ended, and the mutes and locks of rooms that have ended.
  void expire(std::int64_t now_ns);

 private:
  // Names a room and a subject.
  using Person = std::pair<std::string, std::string>;
  [[nodiscard]] bool has_mutes(const std::string& room) const;

  // Holds when each ends.
  std::map<Person, std::int64_t> bans_;
  std::set<Person> mutes_;
  // These rooms are locked.
  std::set<std::string> locks_;
  // Holds when empty rooms with mutes or a lock end.
  std::map<std::string, std::int64_t> ends_ns_;
  // Each may enter a locked room until then.
  std::map<Person, std::int64_t> returning_;
};

}  // namespace hairnet::server
