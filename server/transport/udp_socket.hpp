#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <span>

#include "core/result.hpp"
#include "server/quic/outgoing.hpp"
#include "server/transport/asio.hpp"

namespace hairnet::server {

// A UDP socket that receives and sends many packets with each system call, and knows to which of its addresses each
// packet came. A socket that is bound to all addresses must answer from the address to which a packet came: the peer
// expects no other one. I/O thread.
class UdpSocket {
 public:
  using OnPacket = std::function<void(const quic::Path&, std::uint8_t ecn, std::span<const std::uint8_t>)>;

  // Binds a socket to the address, which is as for Listener. The error is one line.
  static Result<std::unique_ptr<UdpSocket>> open(SerialExecutor executor, const asio::ip::address& address,
                                                 std::uint16_t port);

  ~UdpSocket();

  // Takes up to some hundred packets that have come, many with each recvmmsg. False when none is left.
  bool receive(const OnPacket& on_packet);
  // Sends all packets in as few calls as possible (sendmmsg, with UDP_SEGMENT where the system cuts bursts). Returns
  // the number of packets that the system did not take.
  std::size_t send(std::span<const quic::Burst> bursts);
  [[nodiscard]] std::uint16_t port() const { return local_.port(); }
  // Whether packets from this local address leave by this socket.
  [[nodiscard]] bool is_of(const quic::Address& local) const;
  // Whether the system cuts bursts into packets (UDP_SEGMENT).
  [[nodiscard]] bool has_segments() const { return has_segments_; }
  asio::ip::udp::socket& native() { return socket_; }

 private:
  explicit UdpSocket(SerialExecutor executor);
  // Asks the system for each packet's local address and ECN bits, and for UDP_SEGMENT.
  void set_options(bool is_v6);

  // The memory of the system calls, which is reused from call to call.
  struct Batch;
  asio::ip::udp::socket socket_;
  asio::ip::udp::endpoint local_;
  std::unique_ptr<Batch> batch_;
  bool has_segments_ = false;
};

}  // namespace hairnet::server
