#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "core/levels/level.hpp"
#include "schema/wire/messages.hpp"
#include "server/exchange/character_key.hpp"
#include "server/exchange/observer_sink.hpp"
#include "server/threading/bounded_queue.hpp"

namespace hairnet::server {

// Commands from the I/O thread to the tick thread, in order. Sessions have validated them: characters exist, and poses,
// materials and winds are in range.
struct OpenSession {
  SessionId session = 0;
  std::shared_ptr<ObserverSink> sink;
  std::string room;
  // Sessions of the same subject share its part of the budget.
  std::uint32_t subject = 0;
  // The session exists already and gets a new sink.
  bool resumed = false;
  // The room has this wind if it begins with this session; none: the server's setting.
  std::optional<Wind> wind = std::nullopt;
};
// The session's connection is lost; its characters stay.
struct DetachSession {
  SessionId session = 0;
};
// The session ends, and so do its characters.
struct CloseSession {
  SessionId session = 0;
  // The session goes on with its room on another server: the wind that it has set stays the room's.
  bool goes_on_elsewhere = false;
};
// A message that the tick acts on has the client's own numbers of characters and members.
struct FromClient {
  SessionId session = 0;
  wire::ClientMessage message;
};
struct PutPoses {
  SessionId session = 0;
  std::int64_t arrived_ns = 0;
  // Capture times are on the server's clock.
  std::vector<wire::PoseSample> poses;
};
struct GroomReady {
  wire::GroomHash groom{};
  std::shared_ptr<const LevelSet> levels;
  // The recording gets the groom's file.
  std::shared_ptr<const std::vector<std::uint8_t>> bytes;
  // These name the files of its basis and its learnt hair, where they are new.
  std::optional<wire::GroomHash> basis = std::nullopt;
  std::optional<wire::GroomHash> learnt = std::nullopt;
};
// The groom was evicted.
struct ForgetGroom {
  wire::GroomHash groom{};
};

using Command = std::variant<OpenSession, DetachSession, CloseSession, FromClient, PutPoses, GroomReady, ForgetGroom>;
using CommandQueue = BoundedQueue<Command>;  // weight: one a command, a pose, a member that it names or that the
                                             // session joins, 64 integers of hair

}  // namespace hairnet::server
