#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "schema/stream/any_stream.hpp"
#include "server/transport/admission.hpp"
#include "server/transport/asio.hpp"
#include "server/transport/transport_counters.hpp"

namespace hairnet::server {

// Connections read at most this many bytes at a time, so that their memory grows with the received bytes.
inline constexpr std::size_t kReadBytes = std::size_t{64} << 10;

// A socket, plain or inside TLS, with the stream operations that Asio and Beast need: one read and one write at a time.
// Bytes that were read to detect the protocol can be put back. Reads and writes fail once the time of expires_after()
// has passed. Lives in a shared_ptr, on the loop's serial executor.
class ByteStream : public AnyStream, public std::enable_shared_from_this<ByteStream> {
 public:
  ByteStream(asio::ip::tcp::socket socket, const asio::ip::tcp::endpoint& peer, Admission::Ticket ticket,
             TransportCounters& counters);
  virtual ~ByteStream();

  executor_type get_executor() override { return socket_.get_executor(); }
  [[nodiscard]] const std::string& peer() const { return peer_; }
  // The peer's IPv4 address or IPv6 /64 network; empty when no limits of one address apply to the connection.
  [[nodiscard]] std::string_view network() const { return ticket_.has_address() ? network_ : std::string_view(); }
  // Replaces the proxy's address by the one that the proxy names. Log and limits use the new one.
  void set_peer(const asio::ip::tcp::endpoint& peer);
  [[nodiscard]] bool is_tls() const { return tls_.has_value(); }
  [[nodiscard]] bool is_open() const { return socket_.is_open(); }
  [[nodiscard]] bool has_expired() const { return has_expired_; }
  // See Admission::Ticket::move_to().
  bool move_to(Admission::Place place) { return ticket_.move_to(place); }
  Admission::Ticket& ticket() { return ticket_; }

  // The bytes come before the ones that are read next, also into the TLS handshake.
  void put_back(std::span<const std::uint8_t> bytes);
  // Does the server's side of the handshake; afterwards all reads and writes are inside TLS. Asserts that there is no
  // TLS yet.
  asio::awaitable<boost::system::error_code> accept_tls(asio::ssl::context& context);

  // Closes the stream after this time, whatever is being done then. A later call replaces the time.
  void expires_after(std::chrono::nanoseconds time);
  void expires_never();
  // While the stream is corked, writes are buffered; the next uncorked write sends them all in one system call.
  void cork(bool corked) { is_corked_ = corked; }
  // Closes the socket at once; a read or write under way then fails. Unread bytes make the system send a reset.
  void close();
  // Ends writing, then reads and drops what the peer still sends for up to a second, then closes. A socket that is
  // closed with unread bytes resets the connection, and the peer would lose our last bytes.
  asio::awaitable<void> close_gracefully();
  // The first half of close_gracefully(): ends TLS, then the sending direction of the socket.
  asio::awaitable<void> end_writing();

  // Writes as many bytes as the system takes without waiting, and returns their number. Asserts that the stream is
  // plain; no write may be in progress. An error is ignored here: the next write meets the same error and reports it.
  std::size_t write_now(std::span<const std::uint8_t> bytes);

 private:
  void read_some(asio::mutable_buffer into, Handler handler) override;
  void write_some(const WriteBuffers& from, Handler handler) override;
  // Completes a write of `bytes`: at once while corked, else when all buffered bytes are written.
  void write_corked(std::size_t bytes, Handler handler);

  asio::ip::tcp::socket socket_;
  std::optional<asio::ssl::stream<asio::ip::tcp::socket&>> tls_;
  asio::steady_timer expiry_;
  std::string peer_, network_;
  Admission::Ticket ticket_;
  TransportCounters* counters_;
  // put_back_: bytes that are read before those of the socket. corked_: bytes that wait for the uncorked write. It
  // fills while leaving_ is being written, because a write in progress must keep its memory.
  std::vector<std::uint8_t> put_back_, corked_, leaving_;
  // The number of timers so far. A cancelled timer whose handler already waits in the loop has an older number, and is
  // ignored.
  std::uint64_t expiry_count_ = 0;
  bool is_corked_ = false, has_expired_ = false;
};

}  // namespace hairnet::server
