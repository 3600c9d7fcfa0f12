#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>
#include <utility>
#include <vector>

namespace hairnet::server {

// The largest packet, in bytes with its size prefix, until the session has joined. Until then the peer may be anyone,
// so it may not fill the server's memory. The largest valid Hello has half as many bytes.
inline constexpr std::size_t kHelloPacketBytesMax = std::size_t{16} << 10;

// A stream beside a connection's ordered packets, for one download. Its own packets are in order.
using DownloadStream = std::int64_t;

// The socket level as a session sees it. I/O thread. It never blocks: what the network does not take waits in a bounded
// queue, and writable() says whether the queue has room.
class Connection {
 public:
  virtual ~Connection() = default;
  // The session has joined: from the next packet on, the peer may send packets of up to kPacketBytesMax. Before, a
  // packet has at most kHelloPacketBytesMax bytes, and a connection that closes may end at once, to free its memory.
  virtual void mark_joined() = 0;
  // Queues a packet to be sent in order. Call it only while writable(), which bounds the queue.
  virtual void send(std::vector<std::uint8_t> packet) = 0;
  // The largest packet that send_datagram() takes; 0: the connection has no datagrams.
  [[nodiscard]] virtual std::size_t datagram_bytes_max() const { return 0; }
  // Queues a packet that may get lost, or overtake others. Call it only while takes_datagrams().
  virtual void send_datagram(std::vector<std::uint8_t> packet) { send(std::move(packet)); }
  // The rate that the network lets through, as far as the connection knows; 0: unknown.
  [[nodiscard]] virtual double bytes_per_s() const { return 0; }
  // Whether the send queue has room. PacketSink::on_writable is called when it has room again.
  [[nodiscard]] virtual bool writable() const = 0;
  // Whether a datagram has room, also while packets that are sent in order have none.
  [[nodiscard]] virtual bool takes_datagrams() const { return writable(); }
  // Whether each download has a stream of its own, on which it waits for nothing but its own packets. The next four
  // calls are for such connections.
  [[nodiscard]] virtual bool has_download_streams() const { return false; }
  // Opens a stream for a download. None: the peer allows no further stream now; PacketSink::on_streams_writable is
  // called when it does.
  virtual std::optional<DownloadStream> open_download() { return std::nullopt; }
  // Whether the stream has room. PacketSink::on_streams_writable is called when it has room again.
  [[nodiscard]] virtual bool takes_more(DownloadStream) const { return false; }
  // Queues a packet of a download. Call it only while takes_more(). `is_last`: the stream ends after this packet.
  virtual void send_download(DownloadStream, std::vector<std::uint8_t> /*packet*/, bool /*is_last*/) {}
  // Ends a stream before its last packet, and drops what waits there.
  virtual void reset_download(DownloadStream) {}
  // Sends the queued packets, for up to two seconds, and closes. The sink is not called again. `reason` is for the log.
  virtual void close(std::string_view reason) = 0;
  // The peer's address and port, for the log only.
  [[nodiscard]] virtual std::string_view peer() const = 0;
  // The peer's IPv4 address or IPv6 /64 network, for limits; empty when no limits of one address apply.
  [[nodiscard]] virtual std::string_view network() const { return {}; }
  // The kind of connection, for the log: "tcp", "tls", "ws", "wss" or "wt".
  [[nodiscard]] virtual std::string_view transport() const { return "none"; }
};

// Receives the packets and events of a connection; implemented by Session. I/O thread.
class PacketSink {
 public:
  virtual ~PacketSink() = default;
  // A whole packet without its size prefix, in the order of sending. The bytes are valid during the call only.
  virtual void on_packet(std::span<const std::uint8_t> packet, std::int64_t now_ns) = 0;
  // A packet that may have overtaken others, or come after them.
  virtual void on_datagram(std::span<const std::uint8_t> packet, std::int64_t now_ns) { on_packet(packet, now_ns); }
  // The size prefix of the next packet is impossible. Nothing more can be read, since nobody knows where a packet
  // begins.
  virtual void on_broken_stream(std::int64_t now_ns) = 0;
  // The send queue has room again after writable() was false.
  virtual void on_writable(std::int64_t now_ns) = 0;
  // A download's stream has room again, or the peer allows one more stream.
  virtual void on_streams_writable(std::int64_t) {}
  // The peer does not want the rest of the download; the stream has ended.
  virtual void on_download_stopped(DownloadStream, std::int64_t) {}
  // The peer or the network has closed the connection. This is the last call; close() by the session itself makes none.
  virtual void on_closed(std::string_view reason, std::int64_t now_ns) = 0;
};

}  // namespace hairnet::server
