#pragma once

#include <functional>
#include <string>
#include <string_view>

#include "server/fleet/fleet_counters.hpp"
#include "server/fleet/room_place.hpp"
#include "server/transport/http_service.hpp"

namespace hairnet::server {

// What /room?name=ROOM needs to know.
struct RoomQuestions {
  std::function<RoomPlace(const std::string& room)> find;
  // Why the holder of that token may not know where the room is; empty: it may. Null: everyone may.
  std::function<std::string(std::string_view token, const std::string& room)> why_refused = {};
};

// /room?name=ROOM says as JSON where a room of the fleet is: 200 with the server to connect to, or 503 and why there is
// none; 400 for a name that no room can have, 401 without a token for that room where one is needed. I/O thread.
class RoomPage final : public HttpService {
 public:
  // `counters` must outlive the page.
  RoomPage(FleetCounters& counters, RoomQuestions questions);

  HttpResponse handle(const HttpRequest& request) override;

 private:
  FleetCounters* counters_;
  RoomQuestions questions_;
};

}  // namespace hairnet::server
