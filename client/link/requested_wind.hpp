#pragma once

#include <cstdint>
#include <optional>

#include "schema/wire/messages.hpp"

namespace hairnet::link {

// The wind that this client has asked for, and when it is sent again: the last client to set the room's wind wins, so
// one that another client has set since stays. One thread.
class RequestedWind {
 public:
  void set(const wire::SetWind& wind);
  // The room goes to another server, which may have been told an older wind.
  void on_sent_on() { is_unconfirmed_ = wind_.has_value(); }
  // What is to be sent now; null: nothing. `may_set`: the server takes a wind, or refuses it for the first time.
  [[nodiscard]] const wire::SetWind* on_welcome(bool may_set);
  [[nodiscard]] const wire::SetWind* on_announced(const wire::RoomWind& announced, std::uint64_t own_session);

 private:
  std::optional<wire::SetWind> wind_;  // none: this client has set none, or another one has set one after it
  // The server has told no wind since this one was sent: it may have been lost with the connection, so it is sent after
  // the next welcome, whoever has set one.
  bool is_unconfirmed_ = false;
  bool is_first_due_ = false;  // the first RoomWind after a welcome, which tells the wind as it was then
  bool may_set_ = false;
};

}  // namespace hairnet::link
