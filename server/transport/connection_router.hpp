#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <unordered_map>
#include <vector>

#include "server/session/connection.hpp"
#include "server/transport/admission.hpp"
#include "server/transport/byte_stream.hpp"
#include "server/transport/http_service.hpp"
#include "server/transport/static_files.hpp"
#include "server/transport/transport_options.hpp"

namespace hairnet::server {

// Lets one log line a second through, so that many refusals do not fill the log.
class LogThrottle {
 public:
  bool allow(std::int64_t now_ns) {
    if (now_ns < next_ns_) return false;
    next_ns_ = now_ns + 1'000'000'000;
    return true;
  }

 private:
  std::int64_t next_ns_ = 0;
};

// Accepts the sockets of one port, detects what each peer speaks, and hands the connection to a session or to the HTTP
// pages. All connections of the port share it. Runs on the loop's serial executor; each pending connection keeps it
// alive.
struct ConnectionRouter : std::enable_shared_from_this<ConnectionRouter> {
  using OpenSession = std::function<PacketSink*(std::shared_ptr<Connection>, std::int64_t now_ns)>;

  TransportOptions options;
  TransportCounters* counters = nullptr;
  // Begins the session of a connection. Empty: the port has pages only.
  OpenSession open_session;
  HttpService* service = nullptr;
  // The addresses that have no limits of one address, and those of proxies, whose header names the client's address.
  std::vector<asio::ip::address> exempt, proxies;
  std::shared_ptr<Admission> admission;
  // Null: there is no certificate, and TLS is refused.
  std::shared_ptr<asio::ssl::context> tls;
  // Null: there is no folder of pages.
  std::unique_ptr<StaticFiles> files;
  // Handshakes and pages under way, which close() ends.
  std::unordered_map<const ByteStream*, std::weak_ptr<ByteStream>> pending;
  // All addresses of the port are of the loopback.
  bool is_local = true;
  bool is_closed = false;
  // Returns the JSON that a page of this host needs to connect by WebTransport (QuicListener::page), or says that there
  // is none. Empty: the port has no sessions.
  std::function<std::string(std::string_view host)> webtransport_page;
  LogThrottle refusal_log, origin_log, host_log, accept_log;

  // Takes a new socket: closes it if the limits refuse it, else serves it in a coroutine.
  void accept(asio::ip::tcp::socket socket);
  // Closes the pending connections; the session registry closes the sessions.
  void close();
  // The number of the address for Admission; none for an exempt address, to which the limits of one address do not
  // apply.
  [[nodiscard]] std::optional<std::uint64_t> limited_address(const asio::ip::address& address) const;
  // Counts a refusal by the limits, and logs it at most once a second.
  void count_refusal(Admission::Verdict verdict, const asio::ip::tcp::endpoint& peer);
  // Returns true when a request may not name this host; counts and logs the refusal. `opens_session`: the request is
  // from a page and opens a session.
  bool refuses_host(std::string_view host, bool opens_session, std::string_view peer);
  // Returns true when a page of this origin may open no session here; counts and logs the refusal.
  bool refuses_origin(std::string_view origin, std::string_view host, std::string_view peer);

 private:
  // Serves a new connection: reads a proxy's header, then calls route(). `is_proxied`: the connection is of a listed
  // proxy.
  asio::awaitable<void> serve(std::shared_ptr<ByteStream> stream, bool is_proxied);
  // Detects the protocol, does the handshake of TLS, and hands the connection to a session or to the pages. The first
  // bytes must come within the opening time-out, and the handshake has the same time again.
  asio::awaitable<void> route(std::shared_ptr<ByteStream> stream);
  // Reads the proxy's header, and counts the connection as one of the address in it. False: the stream is closed.
  asio::awaitable<bool> read_proxy_header(ByteStream& stream);
};

// Answers requests until the connection ends or becomes a WebSocket.
asio::awaitable<void> serve_http(std::shared_ptr<ConnectionRouter> router, std::shared_ptr<ByteStream> stream);

}  // namespace hairnet::server
