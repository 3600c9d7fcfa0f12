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
  // The `entries_max` of the calls below bounds the bans, mutes and locks of all rooms together. ban(), mute() and
  // lock() return false, and change nothing, when they would need one more.

  // Bans the subject until `until_ns`, in place of an earlier ban. If `until_ns` is not after `now_ns`, only ends an
  // earlier ban.
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

  // The rules of one room.
  struct OfRoom {
    // Each banned subject, with the time at which its ban ends.
    std::vector<std::pair<std::string, std::int64_t>> bans;
    std::vector<std::string> mutes;
    bool is_locked = false;
    // The subjects that may enter the locked room until return_until_ns: its members on its earlier server.
    std::vector<std::string> returning;
    std::int64_t return_until_ns = 0;
  };
  [[nodiscard]] OfRoom of_room(const std::string& room, std::int64_t now_ns) const;
  // Replaces all rules of the room. Returns how many bans, mutes and locks were left out beyond `entries_max`. The lock
  // and the mutes are taken before the bans, so bans are left out first.
  std::size_t replace(const std::string& room, const OfRoom& rules, std::int64_t now_ns, std::size_t entries_max);
  // Forgets all that was decided about the room, bans included.
  void forget(const std::string& room);
  // Whether the subject was a member of the locked room at its earlier server, and may still come back.
  [[nodiscard]] bool may_return(const std::string& room, const std::string& subject, std::int64_t now_ns) const;

  // A session has entered the room, so its mutes and lock do not end.
  void open_room(const std::string& room) { ends_ns_.erase(room); }
  // The last session has left: the room ends at `ends_ns` unless a session enters before.
  void close_room(const std::string& room, std::int64_t ends_ns);
  // Forgets bans that have ended, and the mutes and locks of rooms that have ended.
  void expire(std::int64_t now_ns);

 private:
  // Names a room and a subject.
  using Person = std::pair<std::string, std::string>;
  [[nodiscard]] bool has_mutes(const std::string& room) const;

  // The time at which each ban ends.
  std::map<Person, std::int64_t> bans_;
  std::set<Person> mutes_;
  // The rooms that are locked.
  std::set<std::string> locks_;
  // The times at which empty rooms with mutes or a lock end.
  std::map<std::string, std::int64_t> ends_ns_;
  // By room and subject: until when the subject may enter the locked room.
  std::map<Person, std::int64_t> returning_;
};

}  // namespace hairnet::server
