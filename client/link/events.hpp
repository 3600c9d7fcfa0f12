#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <variant>
#include <vector>

#include "client/link/frame.hpp"
#include "schema/wire/messages.hpp"

namespace hairnet::link {

// The server has welcomed the client: for the first time, or after a Reconnecting.
struct Connected {
  wire::Welcome welcome;
  // True after a Reconnecting; `welcome.resumed` then says whether the server still had the session.
  bool again = false;
};
// The connection is lost and the link is reconnecting; Connected or Disconnected follows.
struct Reconnecting {
  // The server's reason; none when the connection broke.
  wire::GoodbyeReason reason = wire::GoodbyeReason::none;
  std::string detail;
  // The wait before the next attempt.
  double wait_s = 0;
};
// The last event. `reason` is the server's, or client_leaves after leaving, or none when the connection broke. `detail`
// describes it in one line.
struct Disconnected {
  wire::GoodbyeReason reason = wire::GoodbyeReason::none;
  std::string detail;
};
// Whether a client whose server ended the session for that reason would be refused again, by the same server or by
// another one.
bool is_final(wire::GoodbyeReason reason);

// A requested groom: its file's bytes, for wire::decode_groom; or null, and the reason in one line.
struct GroomFetched {
  wire::GroomHash hash{};
  std::shared_ptr<const std::vector<std::uint8_t>> bytes;
  std::string error;
};
// What a link reports to its caller, in order.
using Event =
    std::variant<Connected, Reconnecting, Disconnected, wire::GroomStatus, wire::CharacterAdded, wire::CharacterRemoved,
                 wire::MemberJoined, wire::MemberChanged, wire::MemberLeft, wire::RoomWind, wire::RoomProps,
                 wire::MemberTouch, wire::Held, wire::RoomHands, FrameBatch, GroomFetched, wire::Error>;

}  // namespace hairnet::link
