#include "server/app/room_page.hpp"

#include <optional>
#include <utility>

#include "core/assert.hpp"
#include "schema/limits.hpp"
#include "schema/lobby.hpp"
#include "server/fleet/fleet_values.hpp"

namespace hairnet::server {
namespace {

constexpr std::string_view kNameKey = "name=", kBearer = "Bearer ";

// Returns the room's name in the query; none: the query has no field `name`. The name is not decoded, because a room's
// name needs no escapes.
std::optional<std::string> name_in(std::string_view query) {
  while (!query.empty()) {
    const std::size_t end = query.find('&');
    const std::string_view field = query.substr(0, end);
    if (field.starts_with(kNameKey)) return std::string(wire::room_of(field.substr(kNameKey.size())));
    query.remove_prefix(end == std::string_view::npos ? query.size() : end + 1);
  }
  return std::nullopt;
}

Counter& counter_of(RoomPlace::Kind kind, FleetCounters& counters) {
  switch (kind) {
    case RoomPlace::Kind::here:
    case RoomPlace::Kind::held:
      return counters.room_answers_held;
    case RoomPlace::Kind::placed:
      return counters.room_answers_placed;
    case RoomPlace::Kind::draining:
      return counters.room_answers_draining;
    case RoomPlace::Kind::deciding:
      return counters.room_answers_deciding;
    case RoomPlace::Kind::full:
      return counters.room_answers_full;
    case RoomPlace::Kind::unknown:
      break;
  }
  return counters.room_answers_unknown;
}

}  // namespace

RoomPage::RoomPage(FleetCounters& counters, RoomQuestions questions)
    : counters_(&counters), questions_(std::move(questions)) {
  HAIRNET_ASSERT(questions_.find);
}

HttpResponse RoomPage::handle(const HttpRequest& request) {
  if (request.path != "/room") return refusal(404, "no such page");
  const std::optional<std::string> room = name_in(request.query);
  // The name is a stranger's text until this check, which lets only harmless characters into the JSON and the log.
  if (!room || !wire::is_room_name(*room)) {
    counters_->room_answers_refused_name.add();
    return refusal(400, room ? wire::kRoomNameRule : "ask for /room?name=ROOM");
  }
  // The token is checked before the directory is asked, so an answer says nothing of rooms that the client may not
  // enter.
  if (questions_.why_refused) {
    const bool has_token = request.authorization.starts_with(kBearer);
    const std::string error =
        questions_.why_refused(has_token ? request.authorization.substr(kBearer.size()) : std::string_view(), *room);
    if (!error.empty()) {
      counters_->room_answers_refused_token.add();
      return refusal(401, error);
    }
  }
  const RoomPlace place = questions_.find(*room);
  counter_of(place.kind, *counters_).add();
  return {
      .status = place.server_id != 0 ? 200 : 503, .content_type = "application/json", .body = room_json(*room, place)};
}

}  // namespace hairnet::server
