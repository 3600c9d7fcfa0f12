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
  std::uint32_t subject = 0;                // sessions of the same subject share its part of the budget
  bool resumed = false;                     // the session exists already and gets a new sink
  std::optional<Wind> wind = std::nullopt;  // of the room, if it begins with this session; none: the server's setting
};
struct DetachSession {  // its connection is lost; its characters stay
  SessionId session = 0;
};
struct CloseSession {  // and its characters
  SessionId session = 0;
  bool goes_on_elsewhere = false;  // with its room, on another server: the wind that it has set stays the room's
};
struct FromClient {  // a message that the tick acts on, in the client's own numbers of characters and members
  SessionId session = 0;
  wire::ClientMessage message;
};
struct PutPoses {
  SessionId session = 0;
  std::int64_t arrived_ns = 0;
  std::vector<wire::PoseSample> poses;  // capture times are on the server's clock
};
struct GroomReady {
  wire::GroomHash groom{};
  std::shared_ptr<const LevelSet> levels;
  std::shared_ptr<const std::vector<std::uint8_t>> bytes;  // for the recording
  std::optional<wire::GroomHash> basis = std::nullopt;     // of the file of its basis, if it is new
  std::optional<wire::GroomHash> learnt = std::nullopt;    // of the file of its learnt hair, if it is new
};
struct ForgetGroom {  // the groom was evicted
  wire::GroomHash groom{};
};

using Command = std::variant<OpenSession, DetachSession, CloseSession, FromClient, PutPoses, GroomReady, ForgetGroom>;
using CommandQueue = BoundedQueue<Command>;  // weight: one a command, a pose, a member that it names or that the
                                             // session joins, 64 integers of hair

}  // namespace hairnet::server
