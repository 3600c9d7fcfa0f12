#pragma once

#include <cstdint>
#include <string>
#include <variant>

#include "schema/wire/messages.hpp"

namespace hairnet::link {

// What a server told its client, in order.
struct Connected {
  wire::Welcome welcome;
  bool again = false;    // after Reconnecting; all that was asked for is being said anew
  bool resumed = false;  // the server still had the session
};
// The connection is lost and will be made anew; Connected or Disconnected follows.
struct Reconnecting {
  wire::GoodbyeReason reason = wire::GoodbyeReason::none;  // the server's; none when the connection broke
  std::string detail;
  double wait_s = 0;  // before the next attempt
};
// The last event. `reason` is the server's, or client_leaves after leaving, or none when the connection broke; `detail`
// says in one line what happened.
struct Disconnected {
  wire::GoodbyeReason reason = wire::GoodbyeReason::none;
  std::string detail;
};
using Event = std::variant<Connected, Reconnecting, Disconnected, wire::GroomStatus, wire::CharacterAdded,
                           wire::CharacterRemoved, wire::LevelRecord, wire::FrameBatch, wire::Error>;

}  // namespace hairnet::link
