#pragma once

#include <functional>
#include <memory>
#include <unordered_map>

#include "server/session/connection.hpp"
#include "server/transport/admission.hpp"
#include "server/transport/byte_stream.hpp"
#include "server/transport/http_service.hpp"
#include "server/transport/static_files.hpp"
#include "server/transport/transport_options.hpp"

namespace hairnet::server {

// At most one line of log a second, so that a flood of refusals is not a flood of lines.
class LogPace {
 public:
  bool pass(std::int64_t now_ns) {
    if (now_ns < next_ns_) return false;
    next_ns_ = now_ns + 1'000'000'000;
    return true;
  }

 private:
  std::int64_t next_ns_ = 0;
};

// What all connections of a port share, and the way of each from its first byte to what it turns out to be. On the
// loop's serial executor; kept alive by those on their way.
struct Reception : std::enable_shared_from_this<Reception> {
  using OpenSession = std::function<PacketSink*(std::shared_ptr<Connection>, std::int64_t now_ns)>;

  TransportOptions options;
  TransportCounters* counters = nullptr;
  OpenSession open_session;
  HttpService* service = nullptr;
  std::shared_ptr<Admission> admission;
  std::shared_ptr<asio::ssl::context> tls;                                  // null: no TLS
  std::unique_ptr<StaticFiles> files;                                       // null: none
  std::unordered_map<const ByteStream*, std::weak_ptr<ByteStream>> guests;  // not, or not yet, sessions
  bool is_closed = false;
  LogPace refusal_log, origin_log, accept_log;

  void welcome(asio::ip::tcp::socket socket);
  void close();  // ends the guests; sessions are others' to end

 private:
  asio::awaitable<void> receive(std::shared_ptr<ByteStream> stream);
  asio::awaitable<void> route(std::shared_ptr<ByteStream> stream);
};

// Answers requests until the connection ends or becomes a WebSocket.
asio::awaitable<void> converse_http(std::shared_ptr<Reception> reception, std::shared_ptr<ByteStream> stream);

}  // namespace hairnet::server
