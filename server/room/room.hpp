#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <set>
#include <utility>

#include "server/room/command.hpp"
#include "server/room/pose_inbox.hpp"
#include "server/room/room_counters.hpp"

namespace hairnet::server {

// One character as the room knows it; its lattice lives in the World.
struct Character {
  wire::GroomHash groom{};
  LevelIndex wanted = LevelIndex::high;  // as soon as the groom's levels are there
  MaterialScale material;
  bool material_changed = false;  // and the World not told
  PoseInbox inbox;
  bool placed = false;                   // in the World, from its first pose on
  LevelIndex level = LevelIndex::rigid;  // in the World
  Pose pose;                             // the one last given to the World
  bool discontinuous = false;            // of this tick's frame
  LevelIndex shown = LevelIndex::rigid;  // of the last frame; easing into the rigid level takes a while
  bool sleep_told = false;               // the last frame said that it is asleep
};

// A session as the room knows it. It sees its own characters.
struct Observer {
  std::shared_ptr<Outlet> outlet;
  std::set<std::pair<wire::GroomHash, LevelIndex>> records_sent;
};

// The characters of all sessions and who sees them. Ordered by key, so that everything done in turn is done in the same
// order in every run. Tick thread.
class Room {
 public:
  explicit Room(RoomCounters& counters) : counters_(&counters) {}

  void open(SessionId session, std::shared_ptr<Outlet> outlet);
  void close(SessionId session);  // its characters must be gone
  void add(CharacterKey key, const wire::GroomHash& groom, LevelIndex level);
  void remove(CharacterKey key);
  void put(const PutPoses& batch);

  // Null when unknown.
  [[nodiscard]] Character* find(CharacterKey key);
  [[nodiscard]] std::map<CharacterKey, Character>& characters() { return characters_; }
  [[nodiscard]] const std::map<CharacterKey, Character>& characters() const { return characters_; }
  [[nodiscard]] std::map<SessionId, Observer>& observers() { return observers_; }

  // The character's pose at a time of the server clock.
  PoseInbox::Sample sample(Character& character, std::int64_t time_ns);

 private:
  RoomCounters* counters_;
  std::map<CharacterKey, Character> characters_;
  std::map<SessionId, Observer> observers_;
};

}  // namespace hairnet::server
