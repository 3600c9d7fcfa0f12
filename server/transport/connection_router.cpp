#include "server/transport/connection_router.hpp"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <array>
#include <string_view>
#include <utility>

#include "core/assert.hpp"
#include "server/telemetry/log_text.hpp"
#include "server/transport/detected_protocol.hpp"
#include "server/transport/io_loop.hpp"
#include "server/transport/origin.hpp"
#include "server/transport/peer_address.hpp"
#include "server/transport/proxy_header.hpp"
#include "server/transport/tcp_connection.hpp"

namespace hairnet::server {
namespace {

using asio::ip::tcp;

// A first message, a TLS ClientHello or a short request usually arrives as a whole, so one read suffices for it.
constexpr std::size_t kFirstReadBytes = 512;

// A record of TLS (type 21, an alert; version 3.1; 2 bytes) with the alert handshake_failure (40), which is fatal (2).
constexpr std::array<std::uint8_t, 7> kTlsHandshakeFailure{21, 3, 1, 0, 2, 2, 40};

// A browser that opens http:// on a port for TLS shows this text; a reset connection would tell a person nothing.
constexpr std::string_view kTlsOnly =
    "HTTP/1.1 400 Bad Request\r\nContent-Type: text/plain; charset=utf-8\r\nContent-Length: 25\r\n"
    "Connection: close\r\n\r\nthis port takes TLS only\n";

Counter& counter_of(TransportCounters& counters, Admission::Verdict verdict) {
  switch (verdict) {
    case Admission::Verdict::address_full:
      return counters.connections_refused_address;
    case Admission::Verdict::address_rate:
      return counters.connections_refused_address_rate;
    case Admission::Verdict::arrivals_full:
      return counters.connections_refused_arrivals;
    case Admission::Verdict::full:
      return counters.connections_refused_full;
    case Admission::Verdict::admitted:
      break;
  }
  HAIRNET_ASSERT(false && "an admitted connection is not refused");
  return counters.connections_refused_full;
}

struct Found {
  DetectedProtocol protocol = DetectedProtocol::unknown;
  boost::system::error_code error;
};

// Reads bytes until they show the peer's protocol, then puts them back for the next reader.
asio::awaitable<Found> read_protocol(ByteStream& stream) {
  std::array<std::uint8_t, kFirstReadBytes> first;
  std::size_t filled = 0;
  Found found;
  while (found.protocol == DetectedProtocol::unknown) {
    // kProtocolBytesMax bytes always show the protocol, so the loop has ended by then.
    HAIRNET_ASSERT(filled < kProtocolBytesMax);
    const auto [error, count] =
        co_await stream.async_read_some(asio::buffer(first.data() + filled, first.size() - filled), kAwaitable);
    if (error) {
      found.error = error;
      break;
    }
    filled += count;
    found.protocol = detect_protocol({first.data(), filled});
  }
  stream.put_back({first.data(), filled});
  co_return found;
}

}  // namespace

void ConnectionRouter::accept(tcp::socket socket) {
  boost::system::error_code error;
  // The limits need the address first, before anything is allocated or read for this connection.
  const tcp::endpoint endpoint = socket.remote_endpoint(error);
  // The peer has already left.
  if (error) {
    counters->handshakes_failed_silent.add();
    return;
  }
  HAIRNET_ASSERT(counters && admission);
  // All connections of a proxy come from its one address, so they have no limits until the header names the real peer.
  const bool is_proxied = std::ranges::count(proxies, unmapped(endpoint.address())) != 0;
  const auto address = is_proxied ? std::nullopt : limited_address(endpoint.address());
  Admission::Ticket ticket;
  const Admission::Verdict verdict = admission->enter(address, channel::monotonic_ns(), ticket);
  if (verdict != Admission::Verdict::admitted) return count_refusal(verdict, endpoint);
  auto stream = std::make_shared<ByteStream>(std::move(socket), endpoint, std::move(ticket), *counters);
  // close() reaches the handshakes by this table. serve() removes the entry before another stream can have the same
  // address.
  pending.emplace(stream.get(), stream);
  asio::co_spawn(
      stream->get_executor(),
      [self = shared_from_this(), stream, is_proxied] { return self->serve(stream, is_proxied); }, asio::detached);
}

std::optional<std::uint64_t> ConnectionRouter::limited_address(const asio::ip::address& address) const {
  if (std::ranges::count(exempt, unmapped(address)) != 0) return std::nullopt;
  return address_number(address);
}

void ConnectionRouter::count_refusal(Admission::Verdict verdict, const tcp::endpoint& peer) {
  Counter& counter = counter_of(*counters, verdict);
  // The counter counts every refusal; the log has at most one line a second, with the count so far.
  counter.add();
  if (refusal_log.allow(channel::monotonic_ns()))
    spdlog::warn("event={} peer={} count={}", counter.name().flat(), shown(peer), counter.value());
}

// If the name of another site leads to this server, a browser takes pages of that site for the server's own. So hosts
// with other names are refused.
bool ConnectionRouter::refuses_host(std::string_view host, bool opens_session, std::string_view peer) {
  // Without a list of hosts, a server of the loopback still refuses pages by a foreign name: a DNS entry of an attacker
  // could point that name at 127.0.0.1 (DNS rebinding), and the page would pass as the server's own.
  static const std::vector<std::string> kLocalHosts{"localhost"};
  const std::vector<std::string>* hosts = &options.hosts;
  if (hosts->empty()) {
    const bool is_own_page = opens_session && options.origins.empty();
    if (!is_local || !is_own_page) return false;
    hosts = &kLocalHosts;
  }
  if (host_allowed(host, *hosts)) return false;
  counters->hosts_refused.add();
  if (host_log.allow(channel::monotonic_ns()))
    spdlog::warn("event=host_refused host={} peer={} count={}", log_text(host), peer, counters->hosts_refused.value());
  return true;
}

bool ConnectionRouter::refuses_origin(std::string_view origin, std::string_view host, std::string_view peer) {
  if (origin_allowed(origin, host, options.origins, is_local)) return false;
  counters->origins_refused.add();
  if (origin_log.allow(channel::monotonic_ns()))
    spdlog::warn("event=origin_refused origin={} peer={} count={}", log_text(origin), peer,
                 counters->origins_refused.value());
  return true;
}

asio::awaitable<void> ConnectionRouter::serve(std::shared_ptr<ByteStream> stream, bool is_proxied) {
  // Until route() knows the protocol, this one deadline covers the proxy's header and the first bytes together.
  stream->expires_after(options.opening_timeout);
  // The entry goes with the handshake, also when that ends by an exception.
  struct Removal {
    decltype(pending)* from;
    ByteStream* stream;
    ~Removal() { from->erase(stream); }
  };
  const Removal removal{&pending, stream.get()};
  bool is_known = true;
  if (is_proxied) is_known = co_await read_proxy_header(*stream);
  if (is_known) co_await route(stream);
}

asio::awaitable<bool> ConnectionRouter::read_proxy_header(ByteStream& stream) {
  // The header and the first bytes behind it may come in any pieces. parse_proxy_header() looks at all bytes each time,
  // and refuses a header that would not fit.
  std::vector<std::uint8_t> first(kProxyHeaderBytesMax);
  std::size_t filled = 0;
  ProxyHeader header;
  while (header.status == ProxyHeader::Status::incomplete) {
    const auto [error, count] =
        co_await stream.async_read_some(asio::buffer(first.data() + filled, first.size() - filled), kAwaitable);
    if (error) {
      (stream.has_expired() ? counters->handshakes_failed_timeout : counters->handshakes_failed_silent).add();
      stream.close();
      co_return false;
    }
    filled += count;
    header = parse_proxy_header(std::span(first).first(filled));
  }
  if (header.status == ProxyHeader::Status::malformed) {
    counters->handshakes_failed_proxy.add();
    stream.close();
    co_return false;
  }
  if (header.peer) {
    stream.set_peer(*header.peer);
    // A loopback address in a proxy's header may be forged, so it gets no exemption from the limits of one address.
    const bool is_loopback = unmapped(header.peer->address()).is_loopback();
    const auto address = is_loopback ? address_number(header.peer->address()) : limited_address(header.peer->address());
    const auto verdict =
        address ? stream.ticket().set_address(*address, channel::monotonic_ns()) : Admission::Verdict::admitted;
    if (verdict != Admission::Verdict::admitted) {
      count_refusal(verdict, *header.peer);
      stream.close();
      co_return false;
    }
  }
  // Bytes behind the header belong to the protocol of the peer itself.
  stream.put_back(std::span(first).subspan(header.bytes, filled - header.bytes));
  co_return true;
}

asio::awaitable<void> ConnectionRouter::route(std::shared_ptr<ByteStream> stream) {
  Found found = co_await read_protocol(*stream);
  // An alert of TLS tells the client what is wrong; a closed socket would look like a broken network.
  if (found.protocol == DetectedProtocol::tls && !tls) {
    counters->handshakes_failed_tls_absent.add();
    co_await asio::async_write(*stream, asio::buffer(kTlsHandshakeFailure), kAwaitable);
    co_await stream->close_gracefully();
    co_return;
  }
  if (found.protocol == DetectedProtocol::tls) {
    // The TLS handshake gets the whole time again, because the client has sent its first bytes in time.
    stream->expires_after(options.opening_timeout);
    if (const auto error = co_await stream->accept_tls(*tls)) {
      (stream->has_expired() ? counters->handshakes_failed_timeout : counters->handshakes_failed_tls).add();
      spdlog::debug("event=tls_failed peer={} detail={}", stream->peer(), log_text(error.message()));
      stream->close();
      co_return;
    }
    counters->connections_tls.add();
    found = co_await read_protocol(*stream);
  }
  if (found.error) {
    (stream->has_expired() ? counters->handshakes_failed_timeout : counters->handshakes_failed_silent).add();
    stream->close();
    co_return;
  }
  if (options.tls_required && !stream->is_tls()) {
    counters->handshakes_failed_tls_required.add();
    // Size-prefixed packets have no such answer: a client of that protocol knows whether it uses TLS.
    if (found.protocol == DetectedProtocol::http)
      co_await asio::async_write(*stream, asio::buffer(kTlsOnly), kAwaitable);
    co_await stream->close_gracefully();
    co_return;
  }
  if (found.protocol == DetectedProtocol::http) {
    co_await serve_http(shared_from_this(), stream);
    co_return;
  }
  // A service port answers HTTP alone.
  if (!open_session) {
    counters->handshakes_failed_http.add();
    stream->close();
    co_return;
  }
  // TLS inside TLS is not supported: its first bytes count as a size prefix, which is out of bounds.
  // The session has deadlines of its own from here on.
  stream->expires_never();
  stream->move_to(Admission::Place::session);
  counters->connections_opened_tcp.add();
  auto connection = std::make_shared<TcpConnection>(stream, *counters);
  // The sink is null when the session was refused. The connection still starts, to send the Goodbye that waits in it.
  PacketSink* sink = open_session(connection, channel::monotonic_ns());
  connection->start(sink);
}

void ConnectionRouter::close() {
  is_closed = true;
  for (const auto& [key, weak_stream] : pending) {
    if (const auto stream = weak_stream.lock()) stream->close();
  }
}

}  // namespace hairnet::server
