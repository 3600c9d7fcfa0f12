#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>

#include "core/result.hpp"
#include "server/session/connection.hpp"
#include "server/transport/io_loop.hpp"
#include "server/transport/transport_counters.hpp"

namespace hairnet::server {

struct TcpListenerDef {
  std::string address = "127.0.0.1";  // IPv4 or IPv6, numeric
  std::uint16_t port = 7420;          // 0: the system picks one
  std::size_t packet_bytes_max = 0;
};

// Listens, and hands each connection to `on_connection`, which answers with its sink or null when it is refused.
class TcpListener {
 public:
  using OnConnection = std::function<PacketSink*(std::shared_ptr<Connection>, std::int64_t now_ns)>;
  // One line that says what is wrong when the address cannot be bound.
  static Result<std::unique_ptr<TcpListener>> create(IoLoop& loop, const TcpListenerDef& def,
                                                     TransportCounters& counters, OnConnection on_connection);
  ~TcpListener();
  [[nodiscard]] std::uint16_t port() const;
  void close();  // takes no more connections

 private:
  struct Impl;
  explicit TcpListener(std::shared_ptr<Impl> impl);
  std::shared_ptr<Impl> impl_;
};

}  // namespace hairnet::server
