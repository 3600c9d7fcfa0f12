#pragma once

#include <cstdint>
#include <optional>

#include "schema/wire/messages.hpp"

namespace hairnet::link {

// The wind that this client has asked for, and when it is sent again. The last client that sets the room's wind wins,
// so this client sends its wind only as long as no other client has set one since. One thread.
class RequestedWind {
 public:
  void set(const wire::SetWind& wind);
  // The room goes to another server, which may know an older wind.
  void on_sent_on() { is_unconfirmed_ = wind_.has_value(); }
  // These two return the wind that is to be sent now; null: nothing. `may_set`: the server accepts a wind from this
  // client, or this is its first welcome, after which a refusal is reported once.
  [[nodiscard]] const wire::SetWind* on_welcome(bool may_set);
  [[nodiscard]] const wire::SetWind* on_announced(const wire::RoomWind& announced, std::uint64_t own_session);

 private:
  // The wind to send again; none: this client has set none, or another client has set one after it.
  std::optional<wire::SetWind> wind_;
  // The server has announced no wind since this one was sent, which may have been lost with the connection. It is then
  // sent after the next welcome, even if another client has set a wind.
  bool is_unconfirmed_ = false;
  // The next RoomWind is the first after a welcome: it has the wind as it was at the welcome.
  bool is_first_due_ = false;
  // The last welcome allows this client to set the wind (see on_welcome).
  bool may_set_ = false;
};

}  // namespace hairnet::link
