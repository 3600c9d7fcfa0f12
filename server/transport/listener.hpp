#pragma once

#include <cstdint>
#include <functional>
#include <memory>

#include "core/result.hpp"
#include "server/session/connection.hpp"
#include "server/transport/http_service.hpp"
#include "server/transport/io_loop.hpp"
#include "server/transport/transport_counters.hpp"
#include "server/transport/transport_options.hpp"

namespace hairnet::server {

// What create() does when another program has the port: it fails, or it takes another port, to check the rest of the
// settings.
enum class PortInUse : std::uint8_t { refused, passed_over };

// One port that speaks size-prefixed TCP, WebSocket and HTTP, each plain or inside TLS, and beside it a UDP port for
// WebTransport. I/O thread. A program may have several. create() listens at once, and the connections wait in the
// system until IoLoop::run. The destructor also ends WebTransport sessions at once; TCP and WebSocket sessions live on
// until their registry closes them.
class Listener {
 public:
  // Returns the session's sink, or null when the connection was refused and has been closed.
  using OpenSession = std::function<PacketSink*(std::shared_ptr<Connection>, std::int64_t now_ns)>;

  // Creates the listener, or returns one line about a wrong address, certificate or folder. `counters` and `service`,
  // which may be null, must outlive the loop's last run. Without `open_session` the port has pages only.
  static Result<std::unique_ptr<Listener>> create(IoLoop& loop, const TransportOptions& options,
                                                  TransportCounters& counters, OpenSession open_session,
                                                  HttpService* service = nullptr,
                                                  PortInUse in_use = PortInUse::refused);
  ~Listener();
  Listener(const Listener&) = delete;
  Listener& operator=(const Listener&) = delete;
  [[nodiscard]] std::uint16_t port() const;
  // Sets the number by which clients reach this port, where a proxy or a container in front of it has another one.
  // Pages then name the same number as the UDP port, unless `udp_port` is set.
  void set_public_port(std::uint16_t port);
  // Stops accepting, and closes the connections that are not sessions: handshakes and pages.
  void close();

 private:
  struct Impl;
  explicit Listener(std::shared_ptr<Impl> impl);
  std::shared_ptr<Impl> impl_;
};

}  // namespace hairnet::server
