#include "server/transport/listener.hpp"

#include <spdlog/spdlog.h>

#include <chrono>
#include <new>
#include <utility>
#include <vector>

#include "server/telemetry/log_text.hpp"
#include "server/transport/connection_router.hpp"
#include "server/transport/io_loop_core.hpp"
#include "server/transport/peer_address.hpp"
#include "server/transport/quic_listener.hpp"
#include "server/transport/tls_context.hpp"

namespace hairnet::server {
namespace {

using asio::ip::tcp;

// After a failed accept (for example without free file descriptors) the next try waits, so that the loop does not spin.
constexpr std::chrono::milliseconds kRetry{100};
// The answer to pages where there is no WebTransport: port 0. A missing page (404) would be an error in the browser's
// log.
constexpr std::string_view kNoWebTransport = "{\"port\":0,\"path\":\"\",\"hashes\":[]}\n";
// While too many connections arrive, the listener asks this often whether it may accept again.
constexpr std::chrono::milliseconds kPause{10};

// An address and a port as a person writes them.
std::string shown(const std::string& address, std::uint16_t port) {
  const bool is_v6 = address.find(':') != std::string::npos;
  return (is_v6 ? "[" + address + "]" : address) + ":" + std::to_string(port);
}

// Opens the port at one address. Zero lets the system pick a port.
boost::system::error_code listen(tcp::acceptor& acceptor, const std::string& text, std::uint16_t port) {
  boost::system::error_code error;
  const auto address = unmapped(asio::ip::make_address(text == "localhost" ? "127.0.0.1" : text, error));
  if (error) return error;
  const tcp::endpoint endpoint(address, port);
  acceptor.open(endpoint.protocol(), error);
  // Connections of an earlier server in TIME_WAIT would otherwise block the port after a restart.
  if (!error) acceptor.set_option(tcp::acceptor::reuse_address(true), error);
  // "::" means all addresses of IPv4 and IPv6, independent of the system's default; any other IPv6 address means itself
  // only.
  if (!error && address.is_v6()) acceptor.set_option(asio::ip::v6_only(!address.is_unspecified()), error);
  if (!error) acceptor.bind(endpoint, error);
  if (!error) acceptor.listen(asio::socket_base::max_listen_connections, error);
  return error;
}

std::string reason_of(const boost::system::error_code& error) {
  if (error == asio::error::invalid_argument)
    return "this is no numeric address; 127.0.0.1 or localhost is for this machine alone, :: or 0.0.0.0 for all";
  if (error == asio::error::access_denied) return error.message() + "; ports below 1024 need privileges";
  return error.message();
}

// Accepts connections at one address until the acceptor is closed.
asio::awaitable<void> accept(std::shared_ptr<ConnectionRouter> router, std::shared_ptr<tcp::acceptor> acceptor) {
  asio::steady_timer retry(acceptor->get_executor());
  while (acceptor->is_open()) {
    auto [error, socket] = co_await acceptor->async_accept(kAwaitable);
    // close() may have run while this coroutine waited.
    if (!acceptor->is_open()) co_return;
    if (!error) {
      try {
        router->accept(std::move(socket));
      } catch (const std::bad_alloc&) {
        // One connection without memory is lost; the exception must not end the coroutine, which accepts all later
        // ones.
        router->counters->accepts_failed.add();
      }
      // Further connections wait in the system's queue.
      bool is_paused = false;
      while (acceptor->is_open() && !router->admission->may_accept(channel::monotonic_ns())) {
        if (!std::exchange(is_paused, true)) router->counters->accepts_paused.add();
        retry.expires_after(kPause);
        co_await retry.async_wait(kAwaitable);
      }
      continue;
    }
    router->counters->accepts_failed.add();
    if (router->accept_log.allow(channel::monotonic_ns()))
      spdlog::warn("event=accept_failed detail={}", log_text(error.message()));
    retry.expires_after(kRetry);
    co_await retry.async_wait(kAwaitable);
  }
}

std::vector<asio::ip::address> parse_addresses(const std::vector<std::string>& texts) {
  std::vector<asio::ip::address> addresses;
  for (const std::string& text : texts) addresses.push_back(unmapped(asio::ip::make_address(text)));
  return addresses;
}

}  // namespace

struct Listener::Impl {
  std::shared_ptr<ConnectionRouter> router;
  std::vector<std::shared_ptr<tcp::acceptor>> acceptors;
  // Null: the port has no WebTransport.
  std::shared_ptr<QuicListener> quic;
};

Result<std::unique_ptr<Listener>> Listener::create(IoLoop& loop, const TransportOptions& options,
                                                   TransportCounters& counters, OpenSession open_session,
                                                   HttpService* service, PortInUse in_use) {
  if (std::string wrong = validate(options); !wrong.empty()) return Refusal(std::move(wrong));
  auto impl = std::make_shared<Impl>();
  impl->router = std::make_shared<ConnectionRouter>();
  ConnectionRouter& router = *impl->router;
  router.options = options;
  router.counters = &counters;
  router.open_session = std::move(open_session);
  router.service = service;
  router.exempt = parse_addresses(options.exempt_addresses);
  router.proxies = parse_addresses(options.proxy_protocol);
  router.admission = std::make_shared<Admission>(options.admission);
  if (!options.tls.certificate.empty()) {
    auto tls = make_tls_context(options.tls);
    if (!tls) return Refusal(std::move(tls.error()));
    router.tls = std::move(*tls);
  }
  if (!options.web_root.empty()) {
    auto files = StaticFiles::open(options.web_root);
    if (!files) return Refusal(std::move(files.error()));
    router.files = std::move(*files);
  }
  std::uint16_t port = options.port, udp_port = options.udp_port;
  for (const std::string& address : options.addresses) {
    auto acceptor = std::make_shared<tcp::acceptor>(loop.core().serial);
    auto error = listen(*acceptor, address, port);
    if (error == asio::error::address_in_use && in_use == PortInUse::passed_over) {
      // A check of the configuration takes any free port, and goes on to check certificates and folders.
      acceptor = std::make_shared<tcp::acceptor>(loop.core().serial);
      port = udp_port = 0;
      error = listen(*acceptor, address, port);
    }
    if (error) return Refusal("cannot listen on " + shown(address, port) + ": " + reason_of(error));
    boost::system::error_code ignored;
    const tcp::endpoint local = acceptor->local_endpoint(ignored);
    // All addresses use the port that the system picked for the first one.
    port = local.port();
    // One address that is not of the loopback lets pages of other machines come in, so the relaxed rules of origins
    // end.
    router.is_local = router.is_local && local.address().is_loopback();
    impl->acceptors.push_back(std::move(acceptor));
  }
  if (router.open_session) router.webtransport_page = [](std::string_view) { return std::string(kNoWebTransport); };
  if (options.webtransport && router.open_session) {
    // WebTransport uses the number of the TCP port by default, so clients that know one number reach both.
    auto quic = QuicListener::create(loop.core().serial, impl->router, udp_port ? udp_port : port, port);
    // Another program may have the UDP port of the same number. Then the server starts without WebTransport, unless the
    // settings name a UDP port.
    if (!quic && udp_port != 0) return Refusal(std::move(quic.error()));
    if (quic) {
      impl->quic = std::move(*quic);
      impl->quic->start();
      // The router outlives the listener in pending connections, so the page must not keep the QUIC sockets open.
      router.webtransport_page = [weak = std::weak_ptr(impl->quic)](std::string_view host) {
        const auto listener = weak.lock();
        return listener ? listener->page(host) : std::string(kNoWebTransport);
      };
    } else {
      spdlog::warn("event=webtransport_unavailable detail={}", log_text(quic.error()));
    }
  }
  for (const auto& acceptor : impl->acceptors)
    asio::co_spawn(loop.core().serial, accept(impl->router, acceptor), asio::detached);
  return std::unique_ptr<Listener>(new Listener(std::move(impl)));
}

Listener::Listener(std::shared_ptr<Impl> impl) : impl_(std::move(impl)) {}

Listener::~Listener() {
  close();
  if (impl_->quic) impl_->quic->shut();
}

std::uint16_t Listener::port() const {
  boost::system::error_code ignored;
  return impl_->acceptors.front()->local_endpoint(ignored).port();
}

void Listener::set_public_port(std::uint16_t port) {
  if (impl_->quic) impl_->quic->set_public_port(port);
}

void Listener::close() {
  boost::system::error_code ignored;
  for (const auto& acceptor : impl_->acceptors) acceptor->close(ignored);
  if (impl_->quic) impl_->quic->refuse_new();
  impl_->router->close();
}

}  // namespace hairnet::server
