#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "core/result.hpp"
#include "server/fleet/server_status.hpp"

// Requests and answers of the HTTP interface of Agones' SDK server, as text: a sidecar of each game server, on its
// loopback. https://agones.dev/site/docs/guides/client-sdks/rest/
namespace hairnet::server::agones {

// Agones sets this variable in the game server's container.
inline constexpr const char* kPortVariable = "AGONES_SDK_HTTP_PORT";
// The port of the sidecar where the variable is not set.
inline constexpr std::uint16_t kPort = 9358;
// The Fleet declares the counter of rooms and the public port by these names.
inline constexpr const char* kRoomsCounter = "rooms";
inline constexpr const char* kPortName = "hairnet";
// A game server carries labels and annotations, so its answer may be long.
inline constexpr std::size_t kAnswerBytesMax = std::size_t{1} << 20;

// One call of the sidecar; the path is of Agones' REST interface, and the body is JSON.
struct Request {
  enum class Method : std::uint8_t { get, post, patch };
  Method method = Method::post;
  std::string path, body;
};

// These make the calls: ready, alive, in use, ended; the question for the game server's description; and the number of
// rooms with its capacity.
Request ready();
Request health();
Request allocate();
Request shutdown();
Request game_server();
Request set_rooms(std::size_t count, std::size_t capacity);

// The public address of a game server: nothing while Agones has not given it one, or one line that says what is wrong
// with the text. Agones names the two halves of a TCPUDP port NAME-tcp and NAME-udp; they have one number.
Result<std::optional<ServerAddress>> parse_address(std::string_view text);
// The value of kPortVariable.
Result<std::uint16_t> parse_port(std::string_view text);

}  // namespace hairnet::server::agones
