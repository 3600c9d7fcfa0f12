#pragma once

#include <boost/asio/awaitable.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/address.hpp>
#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "client/link/address.hpp"
#include "client/link/webtransport/page.hpp"

// The interface of a connection to a server, over any transport. Only sources that use Asio include it.
namespace hairnet::link {

namespace asio = boost::asio;

struct StreamOptions {
  Address server;
  TlsOptions tls;
  // The client's own address; none: the system chooses.
  std::optional<asio::ip::address> local = {};
};

// One connection over one of the transports. Everything on the thread of its io_context.
class ServerStream {
 public:
  struct Read {
    // They are valid until the next read.
    std::span<const std::uint8_t> bytes;
    // One line if the connection has ended, else empty.
    std::string error;
    // The bytes are exactly one packet; otherwise they are a piece of a stream of packets.
    bool is_packet = false;
  };

  virtual ~ServerStream() = default;
  // Resolves, connects, shakes hands. Returns an empty string, or one line with the reason of the failure.
  virtual asio::awaitable<std::string> open() = 0;
  virtual asio::awaitable<Read> read() = 0;
  // For a transport with messages, `bytes` is one packet. A packet that may be lost may also overtake other packets.
  // Returns false when the connection has ended; read() then returns the reason.
  virtual asio::awaitable<bool> write(std::span<const std::uint8_t> bytes, bool may_be_lost) = 0;
  // Tells the server that nothing more will be written.
  virtual void half_close() = 0;
  // Ends the connection; pending operations end soon.
  virtual void close() = 0;
  [[nodiscard]] virtual bool has_messages() const = 0;
  // Whether packets that may be lost travel as datagrams; otherwise they travel in order with all others.
  [[nodiscard]] virtual bool has_datagrams() const { return false; }
  // "webtransport", or the scheme of an address.
  [[nodiscard]] virtual std::string_view transport() const = 0;
  // One line that says why the transport is not WebTransport, which was tried before. Empty: the transport is
  // WebTransport, or WebTransport was not tried.
  [[nodiscard]] virtual std::string_view fallback_reason() const { return {}; }
  // Waits until WebTransport is available, for an open stream that could not have it. Returns an open session. Null:
  // this stream does not wait for WebTransport, or was closed.
  virtual asio::awaitable<std::shared_ptr<ServerStream>> better() { co_return nullptr; }
};

std::unique_ptr<ServerStream> make_packet_stream(asio::io_context& io, StreamOptions options);
std::unique_ptr<ServerStream> make_web_socket_stream(asio::io_context& io, StreamOptions options);
// Makes a stream of the address's kind.
std::unique_ptr<ServerStream> make_server_stream(asio::io_context& io, StreamOptions options);

// What several streams to one server share of its WebTransport page. One thread.
struct WebTransportMemory {
  // The page as it was read last; none after a session failed to open.
  std::optional<WebTransportPage> page = {};
  // The address of the machine that has answered with the page.
  std::optional<asio::ip::address> server;
};

// Why a WebTransport session did not open.
enum class WebTransportFailure : std::uint8_t {
  none,
  // The server does not answer at all.
  unreachable,
  // The server has no WebTransport.
  absent,
  // The server offers WebTransport, but no session opened.
  blocked,
};

class WebTransportAttempt : public ServerStream {
 public:
  [[nodiscard]] virtual WebTransportFailure failure() const = 0;
  // Handles packets for a moment without reading, so that the server hears from a client that does not read now. What
  // arrives waits for read(), and the server may send no more than the window. Returns false when the connection has
  // ended; read() then returns the reason.
  virtual asio::awaitable<bool> rest() = 0;
};

// `memory` is shared by streams that should read the page once together; null: this stream reads it for itself.
std::shared_ptr<WebTransportAttempt> make_web_transport_stream(asio::io_context& io, StreamOptions options,
                                                               std::shared_ptr<WebTransportMemory> memory = {});

// A network that drops UDP sends no error: after this time the address's own transport is tried.
constexpr std::chrono::milliseconds kWebTransportWait{3000};

// What the attempts of one link remember: a network that has blocked WebTransport is not tried again at once.
struct FallbackMemory {
  // After an attempt that was blocked, WebTransport is not tried for this long (LinkOptions::blocked_for).
  std::chrono::nanoseconds blocked_for;
  // WebTransport is not tried until then, on the clock of channel::monotonic_ns().
  std::int64_t blocked_until_ns = 0;
  // One line that says why the last attempt had no WebTransport.
  std::string blocked_reason = {};
};

// A stream over WebTransport, or of the address's kind where that is not available in time.
std::unique_ptr<ServerStream> make_fallback_stream(asio::io_context& io, StreamOptions options,
                                                   std::shared_ptr<FallbackMemory> memory);

}  // namespace hairnet::link
