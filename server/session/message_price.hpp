#pragma once

#include <string>

#include "schema/wire/messages.hpp"
#include "server/session/counts_by_name.hpp"

namespace hairnet::server {

// What a client's message costs the server, in units of a plain message: about 2 us of the I/O and the tick thread.
// Each session has SessionLimits::messages_per_s of them. `room` is the session's. Poses and hands have a rate of their
// own, and the bytes of requested grooms are free. A resume has a price of 1: SessionLimits::resume_interval_ns bounds
// its cost, and so does the number of members that a tick announces.
inline double price_of(const auto&, const CountsByName&, const std::string& /*room*/) {
  return 1;
}
// The price of a message that the server sends to everyone in the room: 64 copies cost as much as one plain message of
// a client.
inline double price_of_news(const CountsByName& rooms, const std::string& room) {
  return static_cast<double>(rooms.count(room).sessions) / 64;
}
// Everyone in the room is told of the character. The message also pays for its RemoveCharacter, which cannot be
// refused. A hair state is copied, and 2048 of its integers cost as much as a plain message.
inline double price_of(const wire::AddCharacter& add, const CountsByName& rooms, const std::string& room) {
  const std::size_t integers = add.state ? add.state->displacements.size() + add.state->velocities.size() : 0;
  return 1 + price_of_news(rooms, room) + static_cast<double>(integers) / 2048;
}
inline double price_of(const wire::SetAppearance&, const CountsByName& rooms, const std::string& room) {
  return 1 + price_of_news(rooms, room);
}
inline double price_of(const wire::SetTouch&, const CountsByName& rooms, const std::string& room) {
  return 1 + price_of_news(rooms, room);
}
inline double price_of(const wire::SetProps& set, const CountsByName& rooms, const std::string& room) {
  return 1 + static_cast<double>(set.props.size()) / 32 + price_of_news(rooms, room);
}
inline double price_of(const wire::TakeHold&, const CountsByName&, const std::string&) {
  // The tick looks through the hair of a head.
  return 2;
}
// The tick decides for each member of the room whether the session wants it: 512 members cost as much as a plain
// message, and so do 256 listed ones.
inline double price_of(const wire::Observe& observe, const CountsByName& rooms, const std::string& room) {
  return 1 + static_cast<double>(rooms.count(room).characters) / 512 +
         static_cast<double>(observe.members.size()) / 256;
}
inline double price_of(const wire::ReportImportance& report, const CountsByName&, const std::string&) {
  return 1 + static_cast<double>(report.members.size()) / 256;
}
inline double price_of(const wire::GroomOffer&, const CountsByName&, const std::string&) {
  // The store looks through the caches.
  return 4;
}
inline double price_of(const wire::GroomRequest&, const CountsByName&, const std::string&) {
  // The builder may have to read a file.
  return 4;
}
inline double price_of(const wire::SetWind&, const CountsByName&, const std::string&) {
  // A change wakes the hair of the whole room, a few times a second at most.
  return 4;
}
inline double price_of(const wire::Moderate&, const CountsByName&, const std::string&) {
  // The registry looks through all sessions, and the log gets a line.
  return 16;
}
// A pose, or a sample of hands, that exceeds their rate costs this, since it is decoded all the same. Without a price a
// client could make the server decode poses at any rate.
inline constexpr double kDroppedPosePrice = 1.0 / 64;

}  // namespace hairnet::server
