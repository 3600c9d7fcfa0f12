#include "server/transport/quic_listener.hpp"

#include <openssl/evp.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cstring>
#include <ctime>
#include <fstream>
#include <limits>
#include <new>
#include <utility>

#include "core/assert.hpp"
#include "server/telemetry/log_text.hpp"
#include "server/transport/io_loop.hpp"
#include "server/transport/peer_address.hpp"
#include "server/transport/webtransport_connection.hpp"

namespace hairnet::server {
namespace {

// The listener checks this often whether it is time for the next certificate. Certificates last for days, but the
// machine's clock may be set.
constexpr std::chrono::minutes kRenewalInterval{10};
// Pings of QUIC are at most this far apart, closer than those of WebSockets. Over TCP a reset tells a client that its
// server is dead; over UDP mostly only silence does.
constexpr std::chrono::seconds kKeepAliveMax{5};
// The longest time for which the timer is set; a later time-out lets the timer be set again.
constexpr std::int64_t kTimer_ns_max = 3'600'000'000'000;

// Admission and log know endpoints of TCP; the bytes of an address are the same for both.
asio::ip::tcp::endpoint endpoint_of(const quic::Address& address) {
  asio::ip::tcp::endpoint endpoint;
  endpoint.resize(address.bytes);
  std::memcpy(endpoint.data(), &address.any, address.bytes);
  return endpoint;
}

std::string base64(const quic::CertificateHash& hash) {
  std::array<unsigned char, 4 * (sizeof(hash) + 2) / 3 + 4> text{};
  const int bytes = EVP_EncodeBlock(text.data(), hash.data(), static_cast<int>(hash.size()));
  return {reinterpret_cast<const char*>(text.data()), static_cast<std::size_t>(bytes)};
}

// Returns EndpointOptions::identity: the machine's secret id and the port, which the next server of this port has, too.
// Empty: the machine has no id.
std::string identity_of(std::uint16_t port) {
  std::ifstream file("/etc/machine-id");
  std::string name;
  if (!(file >> name) || name.size() < 32) return {};
  return name + ":" + std::to_string(port);
}

quic::EndpointOptions endpoint_options(const TransportOptions& options, std::uint16_t port) {
  const auto ns = [](std::chrono::nanoseconds time) { return std::int64_t{time.count()}; };
  quic::EndpointOptions made;
  made.connection.handshake_timeout_ns = made.connection.opening_timeout_ns = ns(options.opening_timeout);
  // Without a next server that resets connections, clients notice a server's death only by silence.
  made.connection.keep_alive_ns = std::min(ns(options.ping_after), ns(kKeepAliveMax));
  made.connection.idle_timeout_ns = 2 * made.connection.keep_alive_ns;
  made.identity = identity_of(port);
  // Connections whose peer's address is not verified may be forged, and each costs memory. With a quarter of
  // arrivals_max of them, new clients must answer a Retry first.
  made.unverified_max = std::max<std::size_t>(1, options.admission.arrivals_max / 4);
  return made;
}

}  // namespace

QuicListener::QuicListener(SerialExecutor executor, std::shared_ptr<ConnectionRouter> router, std::uint16_t tcp_port)
    : executor_(executor), router_(std::move(router)), tcp_port_(tcp_port), timer_(executor), renewal_(executor) {}

Result<std::shared_ptr<QuicListener>> QuicListener::create(SerialExecutor executor,
                                                           std::shared_ptr<ConnectionRouter> router,
                                                           std::uint16_t udp_port, std::uint16_t tcp_port) {
  std::shared_ptr<QuicListener> made(new QuicListener(executor, std::move(router), tcp_port));
  if (auto opened = made->open(udp_port); !opened) return Refusal(std::move(opened.error()));
  return made;
}

Result<void> QuicListener::open(std::uint16_t udp_port) {
  const TransportOptions& options = router_->options;
  for (const std::string& address : options.addresses) {
    auto socket = UdpSocket::open(
        executor_, unmapped(asio::ip::make_address(address == "localhost" ? "127.0.0.1" : address)), udp_port);
    if (!socket)
      return Refusal("cannot listen on UDP port " + std::to_string(udp_port) + " of " + address + ": " +
                     socket.error());
    udp_port = (*socket)->port();
    sockets_.push_back(std::move(*socket));
  }
  std::shared_ptr<const quic::Credentials> credentials;
  if (!options.tls.certificate.empty()) {
    auto loaded = quic::Credentials::load(options.tls.certificate, options.tls.key);
    if (!loaded) return Refusal(std::move(loaded.error()));
    credentials = std::move(*loaded);
  } else {
    auto own = quic::OwnCertificates::make(std::time(nullptr));
    if (!own) return Refusal(std::move(own.error()));
    credentials = own->current();
    own_ = std::move(*own);
  }
  quic::Gate& gate = *this;
  endpoint_ = std::make_unique<quic::Endpoint>(
      endpoint_options(options, port()), std::move(credentials), gate, router_->counters->quic,
      [this](std::span<const quic::Burst> bursts) { send(bursts); }, channel::monotonic_ns());
  return {};
}

void QuicListener::start() {
  const auto self = shared_from_this();
  for (const auto& socket : sockets_)
    asio::co_spawn(
        executor_, [self, socket] { return self->receive(socket); }, asio::detached);
  if (own_)
    asio::co_spawn(
        executor_, [self] { return self->renew_certificates(); }, asio::detached);
}

void QuicListener::shut() {
  endpoint_ = nullptr;
  timer_.cancel();
  renewal_.cancel();
  boost::system::error_code ignored;
  for (const auto& socket : sockets_) socket->native().close(ignored);
}

asio::awaitable<void> QuicListener::receive(std::shared_ptr<UdpSocket> socket) {
  while (endpoint_) {
    // The coroutine waits for readiness only: recvmmsg then takes many packets at once, which Asio's own receive
    // cannot.
    const auto [error] = co_await socket->native().async_wait(asio::ip::udp::socket::wait_read, kAwaitable);
    if (error || !endpoint_) co_return;
    bool may_have_more = true;
    while (may_have_more && endpoint_) {
      const std::int64_t now_ns = channel::monotonic_ns();
      // A packet for which there is no memory is lost, as any datagram may be; the socket goes on with the next one.
      try {
        may_have_more =
            socket->receive([&](const quic::Path& path, std::uint8_t ecn, std::span<const std::uint8_t> bytes) {
              if (endpoint_) endpoint_->receive(path, ecn, bytes, now_ns);
            });
        // One flush after a batch of packets writes all answers together.
        if (endpoint_) flush();
      } catch (const std::bad_alloc&) {
        if (memory_log_.allow(now_ns)) spdlog::warn("event=datagrams_lost detail=\"no memory was left\"");
      }
      // A flood of packets must not keep TCP connections and timers waiting.
      if (may_have_more) co_await asio::post(executor_, kAwaitable);
    }
  }
}

asio::awaitable<void> QuicListener::renew_certificates() {
  while (endpoint_) {
    renewal_.expires_after(kRenewalInterval);
    co_await renewal_.async_wait(kAwaitable);
    if (!endpoint_) co_return;
    if (const auto done = own_->poll(std::time(nullptr)); !done)
      spdlog::warn("event=certificate_failed detail={}", log_text(done.error()));
    // Existing connections keep the certificate that they began with.
    endpoint_->set_credentials(own_->current());
  }
}

void QuicListener::want_flush() {
  // A tick makes many sessions send; they share one flush and so one system call.
  if (std::exchange(flush_wanted_, true)) return;
  asio::post(executor_, [self = shared_from_this()] {
    self->flush_wanted_ = false;
    if (self->endpoint_) self->flush();
  });
}

void QuicListener::flush() {
  const std::int64_t now_ns = channel::monotonic_ns();
  endpoint_->flush(now_ns);
  // Sessions that became writable within the flush have sent more. Writing them at once could go on without end.
  if (endpoint_->has_work()) want_flush();
  const std::int64_t due_ns = std::min(endpoint_->due_ns(), now_ns + kTimer_ns_max);
  // A timer that is due sooner stays: to set a timer costs a system call.
  if (due_ns >= timer_ns_) return;
  timer_ns_ = due_ns;
  timer_.expires_after(std::chrono::nanoseconds(std::max<std::int64_t>(0, due_ns - now_ns)));
  // A cancelled timer reports an error, so an older wait does nothing.
  timer_.async_wait([weak = weak_from_this()](const boost::system::error_code& error) {
    const auto self = weak.lock();
    if (error || !self || !self->endpoint_) return;
    self->timer_ns_ = std::numeric_limits<std::int64_t>::max();
    self->flush();
  });
}

void QuicListener::send(std::span<const quic::Burst> bursts) {
  // Each run of bursts with local addresses of one socket is sent by that socket. Usually one socket sends all of them.
  for (std::size_t begin = 0; begin < bursts.size();) {
    const auto is_of = [&](const auto& socket) { return socket->is_of(bursts[begin].path.local); };
    const auto socket = std::ranges::find_if(sockets_, is_of);
    std::size_t end = begin + 1;
    while (end < bursts.size() && socket != sockets_.end() && (*socket)->is_of(bursts[end].path.local)) ++end;
    if (socket != sockets_.end())
      router_->counters->quic.dropped_unsent.add((*socket)->send(bursts.subspan(begin, end - begin)));
    begin = end;
  }
}

bool QuicListener::may_begin(std::int64_t now_ns) {
  return router_->admission->may_accept(now_ns);
}

std::shared_ptr<void> QuicListener::admit(const quic::Address& remote, std::int64_t now_ns) {
  const asio::ip::tcp::endpoint peer = endpoint_of(remote);
  Admission::Ticket ticket;
  const auto verdict = router_->admission->enter(router_->limited_address(peer.address()), now_ns, ticket);
  if (verdict == Admission::Verdict::admitted)
    return std::make_shared<QuicTicket>(std::move(ticket), *router_->counters);
  router_->count_refusal(verdict, peer);
  return nullptr;
}

int QuicListener::on_request(const quic::Address& remote, const http3::Request& request) {
  if (request.path != WebTransportConnection::kPath) return 404;
  if (router_->is_closed) return 503;
  // The page came from the TCP port, which its origin names, and the request names the UDP port; the rules of origins
  // compare the two.
  std::string authority = request.authority;
  const std::string udp = ":" + std::to_string(port());
  if (port() != tcp_port_ && authority.ends_with(udp))
    authority.replace(authority.size() - udp.size(), udp.size(), ":" + std::to_string(tcp_port_));
  const std::string peer = shown(endpoint_of(remote));
  if (router_->refuses_host(authority, !request.origin.empty(), peer)) return 421;
  return router_->refuses_origin(request.origin, authority, peer) ? 403 : 200;
}

std::shared_ptr<quic::SessionSink> QuicListener::on_session(quic::Connection& quic, std::int64_t now_ns) {
  // admit() has made the ticket before any session could open.
  auto ticket = std::static_pointer_cast<QuicTicket>(quic.ticket());
  HAIRNET_ASSERT(ticket);
  ticket->ticket.move_to(Admission::Place::session);
  router_->counters->connections_opened_webtransport.add();
  const asio::ip::tcp::endpoint peer = endpoint_of(quic.remote());
  auto connection = std::make_shared<WebTransportConnection>(
      quic, shown(peer), ticket->ticket.has_address() ? network_of(peer.address()) : std::string(), ticket,
      *router_->counters, [weak = weak_from_this()] {
        if (const auto self = weak.lock()) self->want_flush();
      });
  PacketSink* sink = router_->open_session(connection, now_ns);
  connection->start(sink);
  // Without a sink the session was refused, and the Goodbye that waits is still sent by the connection's close.
  return sink ? connection : nullptr;
}

std::string QuicListener::page(std::string_view host) const {
  // A page that was requested at the public port, of a load balancer or of Agones, must connect to the same number.
  const bool is_public = port() == tcp_port_ && public_port_ != 0 && host.ends_with(":" + std::to_string(public_port_));
  std::string hashes;
  if (own_) {
    for (const quic::CertificateHash& hash : own_->hashes()) {
      if (!hashes.empty()) hashes += ',';
      hashes.append("\"").append(base64(hash)).append("\"");
    }
  }
  return "{\"port\":" + std::to_string(is_public ? public_port_ : port()) + ",\"path\":\"" +
         std::string(WebTransportConnection::kPath) + "\",\"hashes\":[" + hashes + "]}\n";
}

}  // namespace hairnet::server
