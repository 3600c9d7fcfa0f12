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
// materials, winds, hands, props and holds are in range. In the World, a session's number is also its ToucherId.

// A session joins a room, or resumes on a new connection. The tick makes or finds its Observer.
struct OpenSession {
  SessionId session = 0;
  // The session and the tick share the sink, so that it exists until both have let it go.
  std::shared_ptr<ObserverSink> sink;
  std::string room;
  // Sessions of the same subject share its part of the budget.
  std::uint32_t subject = 0;
  // The session exists already and gets a new sink.
  bool resumed = false;
  // The room has this wind if it begins with this session; none: the server's setting.
  std::optional<Wind> wind = std::nullopt;
  // If no other session is in the room, these props replace all that the tick has for the room.
  std::vector<wire::Prop> props = {};
};
// Whether the session may touch hair of others who allow it; without this command it may. It outlives the session's
// connection.
struct SetTouchRight {
  SessionId session = 0;
  bool may_touch_others = true;
};
// The session's connection is lost; its characters stay.
struct DetachSession {
  SessionId session = 0;
};
// The session ends, and so do its characters.
struct CloseSession {
  SessionId session = 0;
  // The client follows its room to another server, so the wind that it has set does not end here.
  bool goes_on_elsewhere = false;
};
// A client's message on which the tick acts. Its numbers of characters are the client's own; the tick makes a
// CharacterKey of them.
struct FromClient {
  SessionId session = 0;
  wire::ClientMessage message;
};
// Poses that have passed PoseFilter, in one command a packet. The queue may refuse them: newer poses follow soon.
struct PutPoses {
  SessionId session = 0;
  // The I/O thread received the packet at this server time; the inbox judges the age of poses by it.
  std::int64_t arrived_ns = 0;
  // Capture times are on the server's clock.
  std::vector<wire::PoseSample> poses;
};
// One sample of a session's hands that has passed PoseFilter. The queue may refuse it, as it may refuse poses.
struct PutHands {
  SessionId session = 0;
  std::int64_t arrived_ns = 0;
  // The capture time is on the server's clock.
  wire::HandsSample sample;
};
// The levels of a groom are built, or have a learnt level more: characters with this groom may use them from now on.
struct GroomReady {
  wire::GroomHash groom{};
  std::shared_ptr<const LevelSet> levels;
  // The recording gets the groom's file.
  std::shared_ptr<const std::vector<std::uint8_t>> bytes;
  // The hashes of the files of the groom's basis and learnt hair, where these are new.
  std::optional<wire::GroomHash> basis = std::nullopt;
  std::optional<wire::GroomHash> learnt = std::nullopt;
};
// The groom was evicted.
struct ForgetGroom {
  wire::GroomHash groom{};
};

// A variant instead of callbacks: the tick takes all commands at its edge, so no state of it changes while it steps.
using Command = std::variant<OpenSession, SetTouchRight, DetachSession, CloseSession, FromClient, PutPoses, PutHands,
                             GroomReady, ForgetGroom>;
// A command weighs one, and one more for each pose, shape of a hand, prop, chosen session, member that it names or that
// the session joins, and 64 integers of hair.
using CommandQueue = BoundedQueue<Command>;

}  // namespace hairnet::server
