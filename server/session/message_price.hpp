#pragma once

#include <string>

#include "schema/wire/messages.hpp"
#include "server/session/census.hpp"

namespace hairnet::server {

// What a client's message costs the server, in units of a plain message: about 2 us of the I/O and the tick thread.
// Each session has SessionLimits::messages_per_s of them. `room` is the session's. Poses and hands have a rate of their
// own, and the bytes of requested grooms are free. A resume has a price of 1: SessionLimits::resume_interval_ns bounds
// its cost, and so does the number of members that a tick announces.
inline double price_of(const auto&, const Census&, const std::string& /*room*/) {
  return 1;
}
// Everyone in the room is told of something.
inline double price_of_news(const Census& rooms, const std::string& room) {
  return static_cast<double>(rooms.count(room).sessions) / 64;
}
// Everyone in the room is told now, and again when the character leaves: RemoveCharacter is paid for here, because it
// cannot be refused. A hair state is copied.
inline double price_of(const wire::AddCharacter& add, const Census& rooms, const std::string& room) {
  const std::size_t integers = add.state ? add.state->displacements.size() + add.state->velocities.size() : 0;
  return 1 + price_of_news(rooms, room) + static_cast<double>(integers) / 2048;
}
inline double price_of(const wire::SetAppearance&, const Census& rooms, const std::string& room) {
  return 1 + price_of_news(rooms, room);
}
inline double price_of(const wire::SetTouch&, const Census& rooms, const std::string& room) {
  return 1 + price_of_news(rooms, room);
}
inline double price_of(const wire::SetProps& set, const Census& rooms, const std::string& room) {
  return 1 + static_cast<double>(set.props.size()) / 32 + price_of_news(rooms, room);
}
inline double price_of(const wire::TakeHold&, const Census&, const std::string&) {
  return 2;  // a head's hair is looked through
}
// Every member is judged once.
inline double price_of(const wire::Observe& observe, const Census& rooms, const std::string& room) {
  return 1 + static_cast<double>(rooms.count(room).characters) / 512 +
         static_cast<double>(observe.members.size()) / 256;
}
inline double price_of(const wire::ReportImportance& report, const Census&, const std::string&) {
  return 1 + static_cast<double>(report.members.size()) / 256;
}
inline double price_of(const wire::GroomOffer&, const Census&, const std::string&) {
  return 4;  // the caches are looked through
}
inline double price_of(const wire::GroomRequest&, const Census&, const std::string&) {
  return 4;  // a file may be read
}
inline double price_of(const wire::SetWind&, const Census&, const std::string&) {
  return 4;  // a change wakes the whole room, a few times a second at most
}
inline double price_of(const wire::Moderate&, const Census&, const std::string&) {
  return 16;  // all sessions are looked through, and a line is logged
}
// A pose, or a sample of hands, that exceeds their rate costs this, since it is decoded all the same.
inline constexpr double kDroppedPosePrice = 1.0 / 64;

}  // namespace hairnet::server
