#pragma once

#include <memory>
#include <variant>
#include <vector>

#include "core/levels/level.hpp"
#include "schema/wire/messages.hpp"
#include "server/exchange/character_key.hpp"
#include "server/exchange/observer_sink.hpp"
#include "server/room/pose_inbox.hpp"
#include "server/threading/bounded_queue.hpp"

namespace hairnet::server {

// Commands from the I/O thread to the tick thread, in order. Sessions have validated them: characters exist, and poses,
// materials and winds are in range.
struct OpenSession {
  SessionId session = 0;
  std::shared_ptr<ObserverSink> sink;
  std::string room;
  bool resumed = false;  // the session exists already and gets a new sink
};
struct DetachSession {  // its connection is lost; its characters stay
  SessionId session = 0;
};
struct CloseSession {  // and its characters
  SessionId session = 0;
};
struct AddCharacter {
  CharacterKey character = 0;
  wire::GroomHash groom{};
  LevelIndex level = LevelIndex::high;  // the finest
  std::optional<wire::HairState> state;
};
struct RemoveCharacter {
  CharacterKey character = 0;
};
struct SetLevel {
  CharacterKey character = 0;
  LevelIndex level = LevelIndex::high;
};
struct SetMaterial {
  CharacterKey character = 0;
  MaterialScale scale;
};
struct SetWind {  // of the session's room
  SessionId session = 0;
  Wind wind;
};
struct SetObserve {
  SessionId session = 0;
  wire::Observe observe;
};
struct SetImportance {
  SessionId session = 0;
  std::vector<wire::MemberImportance> members;
};
struct MakeKeyframes {
  SessionId session = 0;
  std::vector<std::uint32_t> members;  // none: all
};
struct PutPoses {
  struct Entry {
    CharacterKey character = 0;
    TimedPose pose;
  };
  std::int64_t arrived_ns = 0;
  std::vector<Entry> poses;
};
struct GroomReady {
  wire::GroomHash groom{};
  std::shared_ptr<const LevelSet> levels;
  std::shared_ptr<const std::vector<std::uint8_t>> bytes;  // for the recording
};
struct ForgetGroom {  // the groom was evicted
  wire::GroomHash groom{};
};

using Command =
    std::variant<OpenSession, DetachSession, CloseSession, AddCharacter, RemoveCharacter, SetLevel, SetMaterial,
                 SetWind, SetObserve, SetImportance, MakeKeyframes, PutPoses, GroomReady, ForgetGroom>;
using CommandQueue = BoundedQueue<Command>;  // weight: one a command, a pose, a member, 64 integers of hair

}  // namespace hairnet::server
