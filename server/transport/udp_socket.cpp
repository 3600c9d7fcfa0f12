#include "server/transport/udp_socket.hpp"

#include <netinet/in.h>
#include <netinet/udp.h>
#include <sys/socket.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <vector>

#include "core/assert.hpp"

namespace hairnet::server {
namespace {

// One system call takes up to this many packets.
constexpr std::size_t kReceiveMax = 32;
// receive() returns after this many system calls, so that the loop's other work has its turn.
constexpr int kReceiveCallsMax = 8;
// The buffer for one packet. QUIC peers send none that is longer; the system cuts and marks a longer packet
// (MSG_TRUNC), which is dropped.
constexpr std::size_t kReceiveBytesMax = 2048;
// A tick's packets for all observers leave in one burst, which the system's default may not hold. The system gives as
// much of this as its settings allow.
constexpr int kSystemBufferBytes = 4 << 20;
constexpr std::size_t kControlBytes = 128;

struct ControlBuffer {
  alignas(cmsghdr) std::array<std::uint8_t, kControlBytes> bytes{};
};

template <class Value>
void put_control(msghdr& message, int level, int type, const Value& value) {
  // Entries follow each other, each padded to its alignment; msg_controllen is where the next one begins.
  auto* at = reinterpret_cast<cmsghdr*>(static_cast<std::uint8_t*>(message.msg_control) + message.msg_controllen);
  HAIRNET_ASSERT(message.msg_controllen + CMSG_SPACE(sizeof(value)) <= kControlBytes);
  at->cmsg_level = level;
  at->cmsg_type = type;
  at->cmsg_len = CMSG_LEN(sizeof(value));
  std::memcpy(CMSG_DATA(at), &value, sizeof(value));
  message.msg_controllen += CMSG_SPACE(sizeof(value));
}

// Reads the packet's local address and its ECN mark from the control data that the system gives beside the packet's
// bytes.
void read_control(msghdr& message, quic::Address& local, std::uint8_t& ecn) {
  for (cmsghdr* at = CMSG_FIRSTHDR(&message); at; at = CMSG_NXTHDR(&message, at)) {
    if (at->cmsg_level == IPPROTO_IP && at->cmsg_type == IP_PKTINFO) {
      in_pktinfo info{};
      std::memcpy(&info, CMSG_DATA(at), sizeof(info));
      local.v4.sin_addr = info.ipi_addr;
    } else if (at->cmsg_level == IPPROTO_IPV6 && at->cmsg_type == IPV6_PKTINFO) {
      in6_pktinfo info{};
      std::memcpy(&info, CMSG_DATA(at), sizeof(info));
      local.v6.sin6_addr = info.ipi6_addr;
    } else if (at->cmsg_level == IPPROTO_IP && at->cmsg_type == IP_TOS) {
      // ECN is the lower two bits; the upper six are the class of traffic.
      ecn = *CMSG_DATA(at) & 3;
    } else if (at->cmsg_level == IPPROTO_IPV6 && at->cmsg_type == IPV6_TCLASS) {
      // IPv4 brings one byte, IPv6 an int.
      int traffic_class = 0;
      std::memcpy(&traffic_class, CMSG_DATA(at), sizeof(traffic_class));
      ecn = static_cast<std::uint8_t>(traffic_class & 3);
    }
  }
}

}  // namespace

struct UdpSocket::Batch {
  std::array<std::array<std::uint8_t, kReceiveBytesMax>, kReceiveMax> packets;
  std::array<mmsghdr, kReceiveMax> received{};
  std::array<iovec, kReceiveMax> into{};
  std::array<quic::Address, kReceiveMax> remotes;
  std::array<ControlBuffer, kReceiveMax> control;

  std::vector<mmsghdr> sent;
  std::vector<iovec> from;
  std::vector<quic::Address> to;
  std::vector<ControlBuffer> sent_control;
};

UdpSocket::UdpSocket(SerialExecutor executor) : socket_(executor), batch_(std::make_unique<Batch>()) {}

UdpSocket::~UdpSocket() = default;

Result<std::unique_ptr<UdpSocket>> UdpSocket::open(SerialExecutor executor, const asio::ip::address& address,
                                                   std::uint16_t port) {
  std::unique_ptr<UdpSocket> made(new UdpSocket(executor));
  const asio::ip::udp::endpoint endpoint(address, port);
  boost::system::error_code error;
  made->socket_.open(endpoint.protocol(), error);
  if (!error && address.is_v6()) made->socket_.set_option(asio::ip::v6_only(!address.is_unspecified()), error);
  if (!error) made->socket_.bind(endpoint, error);
  if (!error) made->socket_.non_blocking(true, error);
  if (!error) made->local_ = made->socket_.local_endpoint(error);
  if (error) return Refusal(error.message());
  made->set_options(address.is_v6());
  return made;
}

void UdpSocket::set_options(bool is_v6) {
  const int handle = socket_.native_handle();
  // Without one of these the socket still works.
  const auto set = [handle](int level, int name, int value) {
    return ::setsockopt(handle, level, name, &value, sizeof(value)) == 0;
  };
  set(SOL_SOCKET, SO_RCVBUF, kSystemBufferBytes);
  set(SOL_SOCKET, SO_SNDBUF, kSystemBufferBytes);
  // QUIC finds out by itself how large packets may be: the system neither cuts them nor guesses.
  if (is_v6) {
    set(IPPROTO_IPV6, IPV6_RECVPKTINFO, 1);
    set(IPPROTO_IPV6, IPV6_RECVTCLASS, 1);
    set(IPPROTO_IPV6, IPV6_MTU_DISCOVER, IPV6_PMTUDISC_PROBE);
  } else {
    set(IPPROTO_IP, IP_PKTINFO, 1);
    set(IPPROTO_IP, IP_RECVTOS, 1);
  }
  // An IPv6 socket of all addresses carries IPv4, too.
  set(IPPROTO_IP, IP_MTU_DISCOVER, IP_PMTUDISC_PROBE);
  // The size 0 changes nothing, and shows whether the kernel knows the option.
  has_segments_ = set(IPPROTO_UDP, UDP_SEGMENT, 0);
}

bool UdpSocket::is_of(const quic::Address& local) const {
  if (local.port() != local_.port()) return false;
  // A socket of all addresses fits each local address of its family.
  if (local_.address().is_unspecified()) return (local.any.sa_family == AF_INET6) == local_.address().is_v6();
  return local == quic::Address::of(local_.data(), static_cast<socklen_t>(local_.size()));
}

bool UdpSocket::receive(const OnPacket& on_packet) {
  Batch& batch = *batch_;
  for (int call = 0; call < kReceiveCallsMax; ++call) {
    for (std::size_t i = 0; i < kReceiveMax; ++i) {
      batch.into[i] = {batch.packets[i].data(), batch.packets[i].size()};
      batch.received[i] = {};
      msghdr& message = batch.received[i].msg_hdr;
      message.msg_name = &batch.remotes[i].any;
      // The kernel writes lengths into these fields, so they are set again before each call.
      message.msg_namelen = sizeof(sockaddr_in6);
      message.msg_iov = &batch.into[i];
      message.msg_iovlen = 1;
      message.msg_control = batch.control[i].bytes.data();
      message.msg_controllen = kControlBytes;
    }
    const int count = ::recvmmsg(socket_.native_handle(), batch.received.data(), kReceiveMax, MSG_DONTWAIT, nullptr);
    if (count <= 0) return false;
    for (std::size_t i = 0; i < static_cast<std::size_t>(count); ++i) {
      msghdr& message = batch.received[i].msg_hdr;
      // The packet is longer than kReceiveBytesMax.
      if ((message.msg_flags & MSG_TRUNC) != 0) continue;
      quic::Path path;
      path.local = quic::Address::of(local_.data(), static_cast<socklen_t>(local_.size()));
      path.remote = batch.remotes[i];
      path.remote.bytes = message.msg_namelen;
      std::uint8_t ecn = 0;
      read_control(message, path.local, ecn);
      on_packet(path, ecn, std::span(batch.packets[i]).first(batch.received[i].msg_len));
    }
    // A batch that is not full has emptied the socket, and another call would find nothing.
    if (count < static_cast<int>(kReceiveMax)) return false;
  }
  return true;
}

std::size_t UdpSocket::send(std::span<const quic::Burst> bursts) {
  Batch& batch = *batch_;
  batch.sent.clear();
  batch.from.clear();
  std::vector<std::pair<const quic::Burst*, std::span<const std::uint8_t>>> pieces;
  for (const quic::Burst& burst : bursts) {
    // With UDP_SEGMENT a burst is one piece, which the system cuts; without it each packet is a piece.
    const std::size_t step = has_segments_ ? burst.bytes.size() : burst.segment_bytes;
    for (std::size_t at = 0; at < burst.bytes.size(); at += step)
      pieces.emplace_back(&burst, burst.bytes.subspan(at, std::min(step, burst.bytes.size() - at)));
  }
  batch.sent.resize(pieces.size());
  batch.from.resize(pieces.size());
  batch.to.resize(pieces.size());
  batch.sent_control.resize(pieces.size());
  for (std::size_t i = 0; i < pieces.size(); ++i) {
    const auto& [burst, bytes] = pieces[i];
    // sendmsg reads these bytes only; its interface has no const.
    batch.from[i] = {const_cast<std::uint8_t*>(bytes.data()), bytes.size()};
    batch.to[i] = burst->path.remote;
    batch.sent_control[i] = {};
    msghdr& message = batch.sent[i].msg_hdr;
    message.msg_name = &batch.to[i].any;
    message.msg_namelen = batch.to[i].bytes;
    message.msg_iov = &batch.from[i];
    message.msg_iovlen = 1;
    message.msg_control = batch.sent_control[i].bytes.data();
    // The source address goes with each packet, so that an answer leaves by the address that the peer knows.
    if (burst->path.local.any.sa_family == AF_INET6) {
      in6_pktinfo info{};
      info.ipi6_addr = burst->path.local.v6.sin6_addr;
      put_control(message, IPPROTO_IPV6, IPV6_PKTINFO, info);
      put_control(message, IPPROTO_IPV6, IPV6_TCLASS, static_cast<int>(burst->ecn));
    } else {
      in_pktinfo info{};
      info.ipi_spec_dst = burst->path.local.v4.sin_addr;
      put_control(message, IPPROTO_IP, IP_PKTINFO, info);
      put_control(message, IPPROTO_IP, IP_TOS, static_cast<int>(burst->ecn));
    }
    if (bytes.size() > burst->segment_bytes)
      put_control(message, IPPROTO_UDP, UDP_SEGMENT, static_cast<std::uint16_t>(burst->segment_bytes));
  }
  std::size_t done = 0, lost = 0;
  while (done < pieces.size()) {
    const int count = ::sendmmsg(socket_.native_handle(), batch.sent.data() + done,
                                 static_cast<unsigned>(pieces.size() - done), MSG_DONTWAIT);
    if (count > 0) {
      done += static_cast<std::size_t>(count);
      continue;
    }
    if (errno == EINTR) continue;
    // The network card cannot cut bursts; from now on each packet is a message.
    if (errno == EIO && has_segments_) {
      has_segments_ = false;
      std::vector<quic::Burst> left;
      for (std::size_t i = done; i < pieces.size(); ++i) {
        left.push_back(*pieces[i].first);
        left.back().bytes = pieces[i].second;
      }
      return lost + send(left);
    }
    // QUIC takes what is dropped here for lost, and slows down. A full system drops all that is left of this wake-up:
    // waiting would delay newer frames. Any other error is taken as an error of one destination.
    const bool is_full = errno == EAGAIN || errno == EWOULDBLOCK || errno == ENOBUFS;
    const std::size_t end = is_full ? pieces.size() : done + 1;
    for (; done < end; ++done)
      lost += (pieces[done].second.size() + pieces[done].first->segment_bytes - 1) / pieces[done].first->segment_bytes;
  }
  return lost;
}

}  // namespace hairnet::server
