#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <unordered_map>
#include <vector>

#include "core/assert.hpp"
#include "core/solver/wind.hpp"
#include "server/exchange/command.hpp"
#include "server/room/character.hpp"
#include "server/room/observer.hpp"
#include "server/room/room_counters.hpp"
#include "server/room/room_touch.hpp"

namespace hairnet::server {

// Characters that can see each other, and the sessions that observe them. The index identifies the room in the World,
// which has one environment for each room, and in recordings. Indices are used again, so the World may still have the
// wind and the bodies of an earlier room when a new one begins.
struct Room {
  struct Slot {
    Character* character = nullptr;
    // The number of characters that have had this slot. A member number alone does not tell an old character from its
    // successor.
    std::uint32_t generation = 0;
  };
  // The index of this room in Rooms::rooms(). A room that is not in use waits for its next name.
  std::uint32_t index = 0;
  bool in_use = false;
  std::string name;
  // The characters by slot, the free slots, and the number of slots that have a character. A member number is a slot
  // plus one.
  std::vector<Slot> slots;
  std::vector<std::uint32_t> free_slots;
  std::size_t member_count = 0;
  // The sessions in the room, in the order in which they came. Rooms owns the observers.
  std::vector<Observer*> observers;
  // The wind as a client set it last. When the session that has set it leaves, it is the wind of the server's settings
  // again.
  Wind wind;
  // The session that has set the wind. Zero: the wind is that of the server's settings, or a client of the room's
  // former server has set it.
  SessionId wind_session = 0;
  // The wind that the sessions in the room were told last.
  wire::RoomWind wind_announced;
  // The wind that the World has for this room; none: it still has that of an earlier room with this index.
  std::optional<Wind> wind_in_world;
  // The World may get another wind from this tick on: each change wakes the hair of the whole room.
  std::uint64_t wind_changes_next = 0;
  // The props and hands in the room, which touch hair.
  RoomTouch touch;
  // The largest stride of the frames for the observers of the room: the most ticks from one frame of a character to its
  // next.
  int stride_max = 1;
  // The room is empty since this time; zero: it is not.
  std::int64_t empty_since_ns = 0;

  [[nodiscard]] bool is_empty() const { return member_count == 0 && observers.empty(); }
};

// All rooms, their characters and observers. Characters and observers are in maps ordered by key, so that every run
// processes them in the same order, and so that their addresses stay while others come and go. It has no lock: the tick
// thread alone changes it, and workers only sample the poses of their own share of characters.
class Rooms {
 public:
  // A new room begins with `wind`, and an empty room is removed after `grace_ns`. With `room_count_max` rooms, the room
  // that has been empty longest is closed before its grace time ends. `counters` must outlive this object.
  Rooms(RoomCounters& counters, const Wind& wind, std::int64_t grace_ns, std::size_t room_count_max)
      : counters_(&counters), wind_(wind), grace_ns_(grace_ns), room_count_max_(room_count_max) {}

  // Adds the session's observer, and asserts that it has none; creates the room if no room has that name.
  Observer& open(SessionId session, const std::string& room, std::shared_ptr<ObserverSink> sink);
  // Ends the session's observer. Asserts that its characters are gone: the caller removes them first.
  void close(SessionId session, std::int64_t now_ns);
  // Sets the room's wind to that of the server's settings.
  void forget_wind(Room& room);
  // Adds a character of the key's session to the session's room; `finest` is its requested level. Null when the session
  // is not known. Asserts that the character does not exist.
  Character* add(CharacterKey key, const wire::GroomHash& groom, LevelIndex finest);
  // Removes the character and frees its slot. An unknown key is no error.
  void remove(CharacterKey key, std::int64_t now_ns);
  // Put poses, or hands, into the inboxes, and count what the inboxes refuse. A character or session that is gone
  // meanwhile is no error.
  void put(const PutPoses& batch);
  void put(const PutHands& hands);
  // The session has no hands until it sends some again.
  void end_hands(Observer& observer);
  // Removes rooms that have been empty for the grace time.
  void poll(std::int64_t now_ns);

  // Null when unknown.
  [[nodiscard]] Character* find(CharacterKey key);
  [[nodiscard]] Observer* observer(SessionId session);
  [[nodiscard]] Room& room(std::uint32_t index) {
    HAIRNET_ASSERT(index < rooms_.size());
    return rooms_[index];
  }
  [[nodiscard]] std::map<CharacterKey, Character>& characters() { return characters_; }
  [[nodiscard]] const std::map<CharacterKey, Character>& characters() const { return characters_; }
  // The same characters in one array, since iterating over a map misses the cache at each node. Valid until a character
  // is added or removed.
  [[nodiscard]] std::span<Character* const> everyone();
  [[nodiscard]] std::map<SessionId, Observer>& observers() { return observers_; }
  [[nodiscard]] const std::map<SessionId, Observer>& observers() const { return observers_; }
  // Includes rooms that are not in use.
  [[nodiscard]] std::deque<Room>& rooms() { return rooms_; }
  [[nodiscard]] const std::deque<Room>& rooms() const { return rooms_; }
  [[nodiscard]] std::size_t room_count() const { return by_name_.size(); }

  // Returns the character's pose at a time of the server clock, and counts extrapolated and stale poses. Workers call
  // it for different characters at once.
  PoseInbox::Sample sample(Character& character, std::int64_t time_ns);

 private:
  // Finds the room of that name, or creates it.
  Room& room_named(const std::string& name);
  // Begins the grace time of a room that has just become empty.
  void note_empty(Room& room, std::int64_t now_ns);
  // Removes the room that has been empty longest, if any room is empty.
  void forget_longest_empty();
  // Removes an empty room. Its index becomes free for another room.
  void forget(Room& room);
  void check_invariants() const;
  static void check_invariants(const Room& room);

  RoomCounters* counters_;
  // A new room has this wind.
  Wind wind_;
  std::int64_t grace_ns_;
  std::size_t room_count_max_;
  std::map<CharacterKey, Character> characters_;
  // Finds a character by its key faster than the map: poses ask for one each.
  std::unordered_map<CharacterKey, Character*> by_key_;
  std::vector<Character*> everyone_;
  // The array that everyone() returns has all characters of characters_.
  bool is_everyone_current_ = true;
  std::map<SessionId, Observer> observers_;
  // A deque, so that references to rooms stay when rooms are added. Rooms are never erased from it, only reused.
  std::deque<Room> rooms_;
  std::vector<std::uint32_t> free_rooms_;
  // The index of each room in use, by its name.
  std::map<std::string, std::uint32_t> by_name_;
};

// The number by which the clients in the room name the character. 0 names no member.
constexpr std::uint32_t member_of(const Character& character) {
  return character.slot + 1;
}

}  // namespace hairnet::server
