#pragma once

#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/result.hpp"
#include "server/quic/endpoint.hpp"
#include "server/quic/own_certificates.hpp"
#include "server/transport/connection_router.hpp"
#include "server/transport/udp_socket.hpp"

namespace hairnet::server {

// WebTransport on the UDP port beside a TCP port: sockets, time and certificates around a QUIC endpoint. It admits
// connections and opens sessions by the rules of the port's router. Runs on the loop's serial executor.
class QuicListener final : public std::enable_shared_from_this<QuicListener>, private quic::Gate {
 public:
  // Binds `udp_port` at the router's addresses, or returns one line. `tcp_port` is that of the router's pages.
  static Result<std::shared_ptr<QuicListener>> create(SerialExecutor executor, std::shared_ptr<ConnectionRouter> router,
                                                      std::uint16_t udp_port, std::uint16_t tcp_port);
  // Begins to receive. The coroutines keep the object alive until shut().
  void start();
  // Connections that exist go on; packets of new ones are dropped and counted.
  void refuse_new() {
    if (endpoint_) endpoint_->refuse_new();
  }
  // Closes the sockets, and ends all sessions at once.
  void shut();
  // JSON that a page needs to connect: the port, the path, and the hashes of the certificates if no authority has
  // signed them. `host` is that of the request for it.
  [[nodiscard]] std::string page(std::string_view host) const;
  // The UDP port that pages name; see Listener::set_public_port(). 0: that of the socket.
  void set_public_port(std::uint16_t port) { public_port_ = port; }
  [[nodiscard]] std::uint16_t port() const { return sockets_.front()->port(); }

 private:
  QuicListener(SerialExecutor executor, std::shared_ptr<ConnectionRouter> router, std::uint16_t tcp_port);
  // Binds the sockets and makes the endpoint with its certificates.
  Result<void> open(std::uint16_t udp_port);
  // Gives the packets of one socket to the endpoint until shut().
  asio::awaitable<void> receive(std::shared_ptr<UdpSocket> socket);
  // Replaces the server's own certificates in time, for the object's life.
  asio::awaitable<void> renew_certificates();
  // Asks for one flush() after the handlers that are ready, however often it is called before.
  void want_flush();
  // Lets the endpoint send, and sets timer_ to the time at which it is due again.
  void flush();
  // Sends bursts by the socket of their local address.
  void send(std::span<const quic::Burst> bursts);

  // These functions implement quic::Gate (server/quic/endpoint.hpp).
  bool may_begin(std::int64_t now_ns) override;
  std::shared_ptr<void> admit(const quic::Address& remote, std::int64_t now_ns) override;
  int on_request(const quic::Address& remote, const http3::Request& request) override;
  std::shared_ptr<quic::SessionSink> on_session(quic::Connection& connection, std::int64_t now_ns) override;

  SerialExecutor executor_;
  std::shared_ptr<ConnectionRouter> router_;
  std::uint16_t tcp_port_, public_port_ = 0;
  std::vector<std::shared_ptr<UdpSocket>> sockets_;
  // The server's own certificates; none: the settings name a certificate.
  std::optional<quic::OwnCertificates> own_;
  // Null once shut.
  std::unique_ptr<quic::Endpoint> endpoint_;
  // timer_ wakes flush(), renewal_ wakes renew_certificates().
  asio::steady_timer timer_, renewal_;
  // timer_ is due at this time; the largest number says that it waits for nothing.
  std::int64_t timer_ns_ = std::numeric_limits<std::int64_t>::max();
  bool flush_wanted_ = false;
  LogThrottle memory_log_;
};

}  // namespace hairnet::server
