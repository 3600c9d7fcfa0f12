#include "server/agones/sidecar_api.hpp"

#include <algorithm>
#include <charconv>
#include <nlohmann/json.hpp>
#include <set>

#include "server/fleet/fleet_values.hpp"

namespace hairnet::server::agones {
namespace {

using Json = nlohmann::json;

Request post(const char* path) {
  return {.method = Request::Method::post, .path = path, .body = "{}"};
}

// The number of the port that clients use; 0 and a reason where none can be told from the others.
Result<std::uint16_t> public_port(const Json& ports) {
  const std::string name = kPortName;
  std::set<std::uint16_t> all;
  for (const Json& port : ports) {
    const auto number = port.is_object() ? port.find("port") : port.end();
    // The text comes from the cluster and may be anything. Nothing of it is used before its type and range are checked.
    if (number == port.end() || !number->is_number_unsigned() || number->get<std::uint64_t>() == 0 ||
        number->get<std::uint64_t>() > 65535)
      return Refusal("a port of the game server has no number from 1 to 65535");
    const auto value = number->get<std::uint16_t>();
    const auto called = port.find("name");
    if (called != port.end() && (*called == name || *called == name + "-tcp")) return value;
    all.insert(value);
  }
  if (all.size() == 1) return *all.begin();
  return Refusal("the game server has several ports, and none of them is named " + name);
}

}  // namespace

Request ready() {
  return post("/ready");
}
Request health() {
  return post("/health");
}
Request allocate() {
  return post("/allocate");
}
Request shutdown() {
  return post("/shutdown");
}
Request game_server() {
  return {.method = Request::Method::get, .path = "/gameserver", .body = {}};
}

Request set_rooms(std::size_t count, std::size_t capacity) {
  // The interface takes 64-bit numbers as text, as protobuf's JSON does.
  const Json body{{"count", std::to_string(count)}, {"capacity", std::to_string(capacity)}};
  return {
      .method = Request::Method::patch, .path = std::string("/v1beta1/counters/") + kRoomsCounter, .body = body.dump()};
}

Result<std::optional<ServerAddress>> parse_address(std::string_view text) {
  // The last argument turns off exceptions: the answer is foreign, and no exception may cross the folder.
  const Json json = Json::parse(text.begin(), text.end(), nullptr, false);
  if (json.is_discarded() || !json.is_object()) return Refusal("the game server is not a JSON object");
  const auto status = json.find("status");
  if (status == json.end() || !status->is_object()) return Refusal("the game server has no status");
  const auto host = status->find("address"), ports = status->find("ports");
  if (host == status->end() || !host->is_string()) return Refusal("the status of the game server has no address");
  if (ports == status->end() || !ports->is_array()) return Refusal("the status of the game server has no ports");
  // Agones fills both in some time after the container has begun.
  if (host->get_ref<const std::string&>().empty() || ports->empty()) return std::optional<ServerAddress>();
  const Result<std::uint16_t> port = public_port(*ports);
  if (!port) return Refusal(port.error());
  ServerAddress address{.host = host->get<std::string>(), .port = *port, .page = {}};
  if (std::string wrong = validate(address); !wrong.empty()) return Refusal(std::move(wrong));
  return std::optional(std::move(address));
}

Result<std::uint16_t> parse_port(std::string_view text) {
  std::uint16_t port = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), port);
  if (error != std::errc() || end != text.data() + text.size() || port == 0)
    return Refusal(std::string(kPortVariable) + " is not a port from 1 to 65535");
  return port;
}

}  // namespace hairnet::server::agones
