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
  std::optional<asio::ip::address> local = {};  // the client's own address; none: the system chooses
};

// One connection over one of the transports. Everything on the thread of its io_context.
class ServerStream {
 public:
  struct Read {
    std::span<const std::uint8_t> bytes;  // valid until the next read
    std::string error;                    // one line, if the connection has ended
    bool is_packet = false;               // exactly one; else a piece of a stream of packets
  };

  virtual ~ServerStream() = default;
  // Resolves, connects, shakes hands. Returns an empty string, or one line with the reason of the failure.
  virtual asio::awaitable<std::string> open() = 0;
  virtual asio::awaitable<Read> read() = 0;
  // For a transport with messages, `bytes` is one packet. One that may be lost may also overtake others. Returns false
  // when the connection has ended; read() then returns the reason.
  virtual asio::awaitable<bool> write(std::span<const std::uint8_t> bytes, bool may_be_lost) = 0;
  virtual void half_close() = 0;  // nothing more will be written
  virtual void close() = 0;       // pending operations end soon
  [[nodiscard]] virtual bool has_messages() const = 0;
  [[nodiscard]] virtual bool has_datagrams() const { return false; }  // else what may be lost is not
  // "webtransport", or the scheme of an address.
  [[nodiscard]] virtual std::string_view transport() const = 0;
  // Why it is not WebTransport, which was tried before, in one line. Empty: it is, or that was not tried.
  [[nodiscard]] virtual std::string_view fallback_reason() const { return {}; }
  // Waits until WebTransport, which this open stream does without, is available after all. Returns an open session, or
  // null: it is not waited for, or this stream was closed.
  virtual asio::awaitable<std::shared_ptr<ServerStream>> better() { co_return nullptr; }
};

std::unique_ptr<ServerStream> make_packet_stream(asio::io_context& io, StreamOptions options);
std::unique_ptr<ServerStream> make_web_socket_stream(asio::io_context& io, StreamOptions options);
// Makes a stream of the address's kind.
std::unique_ptr<ServerStream> make_server_stream(asio::io_context& io, StreamOptions options);

// What several streams to one server learn of its WebTransport. One thread.
struct WebTransportMemory {
  std::optional<WebTransportPage> page = {};  // as last read, unless a session then failed to open
  std::optional<asio::ip::address> server;    // where the page was read
};

// Why a WebTransport session did not open.
enum class WebTransportFailure : std::uint8_t {
  none,
  unreachable,  // the server does not answer at all
  absent,       // it has no WebTransport
  blocked,      // it offers WebTransport, but no session opened
};

class WebTransportAttempt : public ServerStream {
 public:
  [[nodiscard]] virtual WebTransportFailure failure() const = 0;
  // For who does not read now: handles packets for a moment, so that the server hears that this end lives. What
  // arrives waits for read(), and the server may send no more than the window. Returns false when the connection has
  // ended; read() then returns the reason.
  virtual asio::awaitable<bool> rest() = 0;
};

// `memory`: of a page that is to be read once for several streams; null: this one reads it for itself.
std::shared_ptr<WebTransportAttempt> make_web_transport_stream(asio::io_context& io, StreamOptions options,
                                                               std::shared_ptr<WebTransportMemory> memory = {});

// Networks that drop UDP say nothing: after this time the address's own transport is tried.
constexpr std::chrono::milliseconds kWebTransportWait{3000};

// What one attempt learns for the next ones.
struct FallbackMemory {
  std::chrono::nanoseconds blocked_for;
  std::int64_t blocked_until_ns = 0;  // until then WebTransport is not tried
  std::string blocked_reason = {};    // or why it was not available, in one line
};

// A stream over WebTransport, or of the address's kind where that is not available in time.
std::unique_ptr<ServerStream> make_fallback_stream(asio::io_context& io, StreamOptions options,
                                                   std::shared_ptr<FallbackMemory> memory);

}  // namespace hairnet::link
