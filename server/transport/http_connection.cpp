#include <algorithm>
#include <chrono>
#include <ctime>
#include <optional>
#include <utility>

#include "server/threading/token_bucket.hpp"
#include "server/transport/beast.hpp"
#include "server/transport/connection_router.hpp"
#include "server/transport/http_response.hpp"
#include "server/transport/io_loop.hpp"
#include "server/transport/websocket_connection.hpp"

namespace hairnet::server {
namespace {

// The fields of browsers fit easily, also with the cookies of other services on the same host.
constexpr std::uint32_t kHeaderBytesMax = 8 << 10;
constexpr std::size_t kTargetBytesMax = 2048;
// Bounds a body that comes with a GET; it is read and ignored.
constexpr std::size_t kBodyBytesMax = 4096;
// Bounds what is read and not yet parsed; Beast's buffer never grows beyond it.
constexpr std::size_t kReadBytesMax = 16 << 10;
// A file leaves in pieces of this size, so its length costs no memory, and a slow reader holds one piece.
constexpr std::size_t kFilePieceBytes = std::size_t{64} << 10;
// The page that tells how to connect by WebTransport (QuicListener::page).
constexpr std::string_view kWebTransportPage = "/wt.json";
// Pages of allowed origins may request this path, with a token.
constexpr std::string_view kRoomPage = "/room";
// A connection that has received its share of bytes looks again after this time (page_bytes_per_s).
constexpr std::chrono::milliseconds kRateWait{10};

using Request = WebSocketConnection::Request;

std::string_view view(beast::string_view text) {
  return {text.data(), text.size()};
}

std::string_view path_of(std::string_view target) {
  return target.substr(0, target.find('?'));
}

bool is_service_path(std::string_view path) {
  return path == "/healthz" || path == "/readyz" || path == "/metrics" || path == "/fleet.json" || path == "/fleet" ||
         path == kRoomPage;
}

// Whether a list of tags, or "*", contains the tag. Weak tags count like strong ones.
bool names_tag(std::string_view list, std::string_view etag) {
  return list == "*" || list.find(etag) != std::string_view::npos;
}

// Whether a comma-separated header field names `word`.
bool offers(std::string_view list, std::string_view word) {
  while (!list.empty()) {
    const std::size_t comma = list.find(',');
    std::string_view item = list.substr(0, comma);
    item.remove_prefix(std::min(item.find_first_not_of(" \t"), item.size()));
    item.remove_suffix(item.size() - std::min(item.find_last_not_of(" \t") + 1, item.size()));
    if (item == word) return true;
    list.remove_prefix(comma == std::string_view::npos ? list.size() : comma + 1);
  }
  return false;
}

// One connection's requests, one at a time; a client that sends several at once gets the answers in order. It lives in
// the frame of serve_http's coroutine.
class HttpConnection {
 public:
  HttpConnection(std::shared_ptr<ConnectionRouter> router, std::shared_ptr<ByteStream> stream)
      : router_(std::move(router)),
        stream_(std::move(stream)),
        options_(&router_->options),
        counters_(router_->counters),
        buffer_(kReadBytesMax),
        bytes_(options_->page_bytes_per_s, options_->page_bytes_per_s, channel::monotonic_ns()) {}

  asio::awaitable<void> run() {
    // A connection keeps its place until requests_per_connection_max requests, so one client cannot occupy a place
    // forever.
    for (std::size_t count = 1; !router_->is_closed; ++count) {
      stream_->expires_after(options_->request_timeout);
      http::request_parser<http::string_body> parser;
      parser.header_limit(kHeaderBytesMax);
      // Beast would end the connection without an answer beyond its limit; read() checks the announced length and
      // answers 413.
      parser.body_limit(boost::none);
      auto refused = co_await read(parser, count == 1);
      // read() closes the stream when nobody is there to read a response.
      if (!stream_->is_open()) co_return;
      const Request& request = parser.get();
      if (!refused) refused = refuse_host(request);
      // A WebSocket needs no place among the pages: it moves on to the sessions at once.
      if (!refused && count == 1 && !stream_->move_to(Admission::Place::http) && !websocket::is_upgrade(request)) {
        counters_->connections_refused_http.add();
        refused = refusal(503, "too many connections ask for pages; try again later");
      }
      // Every request of this path is treated as an upgrade: a plain GET gets the answer that it must upgrade, and no
      // file of that name is looked for.
      if (!refused && router_->open_session && path_of(view(request.target())) == WebSocketConnection::kPath) {
        refused = refuse_upgrade(request);
        if (!refused) {
          co_await upgrade(request);
          co_return;
        }
      }
      if (count == 1 && !refused) counters_->connections_opened_http.add();
      // A refused request may have left bytes unread, which would be taken for the next request. So its connection
      // ends.
      const bool keep = !refused && request.keep_alive() && count < options_->requests_per_connection_max;
      StaticFile file;
      const HttpResponse response = refused ? std::move(*refused) : answer(request, file);
      const bool sent = co_await respond(response, file, request.method() != http::verb::head, keep);
      if (!sent || !keep) break;
    }
    co_await stream_->close_gracefully();
  }

 private:
  // Reads the request, or returns the response that refuses it. Closes the stream when no response can be sent.
  asio::awaitable<std::optional<HttpResponse>> read(http::request_parser<http::string_body>& parser, bool is_first) {
    const auto [error, bytes] = co_await http::async_read_header(*stream_, buffer_, parser, kAwaitable);
    if (error == http::error::header_limit || error == http::error::buffer_overflow) {
      const std::string_view sent(static_cast<const char*>(buffer_.data().data()), buffer_.size());
      // Beast reports one error for both cases. Without a line's end, it is the address that fills the buffer.
      const bool is_long_line = parser.get().target().empty() && sent.find('\n') == std::string_view::npos;
      co_return is_long_line ? refusal(414, "the address is too long") : refusal(431, "the header is too long");
    }
    if (error) {
      if (is_first)
        (stream_->has_expired() ? counters_->handshakes_failed_timeout : counters_->handshakes_failed_http).add();
      // Only bytes that are no HTTP get an answer. A peer that left, or a time-out, does not read one.
      if (error.category() == http::make_error_code(http::error::bad_method).category() &&
          error != http::error::end_of_stream && error != http::error::partial_message)
        co_return refusal(400, "this is not HTTP/1.1");
      stream_->close();
      co_return std::nullopt;
    }
    const Request& request = parser.get();
    if (request.target().size() > kTargetBytesMax) co_return refusal(414, "the address is too long");
    // With two Host fields, this server could check one while a proxy in front goes by the other (request smuggling).
    if (request.version() >= 11 && request.count(http::field::host) != 1)
      co_return refusal(400, "there must be one Host");
    // Browsers ask with OPTIONS before a page of another origin may send its token along (a CORS preflight).
    const bool asks_for_leave =
        request.method() == http::verb::options && path_of(view(request.target())) == kRoomPage && router_->service;
    if (request.method() != http::verb::get && request.method() != http::verb::head && !asks_for_leave)
      co_return refusal(405, "there is nothing to change here");
    // A body of unknown length could go on forever.
    if (parser.chunked() || parser.content_length().value_or(0) > kBodyBytesMax)
      co_return refusal(413, "a request here has no body");
    // The body is read and dropped, so that the next request begins behind it.
    const auto [body_error, body_bytes] = co_await http::async_read(*stream_, buffer_, parser, kAwaitable);
    if (body_error) stream_->close();
    co_return std::nullopt;
  }

  // Finds what the path means: a page of the service, WebTransport's description, or a file, which `file` then holds
  // open.
  HttpResponse answer(const Request& request, StaticFile& file) {
    const std::string_view target = view(request.target()), path = path_of(target);
    if (router_->service && is_service_path(path)) {
      const std::string_view query = path.size() < target.size() ? target.substr(path.size() + 1) : std::string_view();
      const HttpRequest question{view(request.method_string()), path, query, stream_->peer(),
                                 view(request[http::field::authorization])};
      if (path == kRoomPage) return answer_page(request, question);
      return router_->service->handle(question);
    }
    if (router_->webtransport_page && path == kWebTransportPage) {
      HttpResponse response{.content_type = "application/json",
                            .body = router_->webtransport_page(view(request[http::field::host]))};
      // The page is public; the session itself checks the origin.
      response.allow_origin = "*";
      return response;
    }
    if (!router_->files) return refusal(404, "there is no such page");
    // A header may have several of these fields.
    std::string accepted;
    const auto fields = request.equal_range(http::field::accept_encoding);
    for (auto field = fields.first; field != fields.second; ++field) accepted.append(view(field->value())).append(",");
    switch (router_->files->find(path, file, accepted_codings(accepted))) {
      case StaticFind::bad_path:
        return refusal(400, "this is no path");
      case StaticFind::not_found:
        return refusal(404, "there is no such page");
      case StaticFind::is_folder: {
        HttpResponse response = refusal(301, "it is a folder");
        response.location = std::string(path) + "/";
        return response;
      }
      case StaticFind::found:
        break;
    }
    HttpResponse response;
    response.content_type = file.content_type;
    response.cache_control = file.cache_control;
    response.content_encoding = file.content_encoding;
    response.vary = "Accept-Encoding";
    response.etag = file.etag;
    response.file_bytes = file.bytes;
    if (names_tag(view(request[http::field::if_none_match]), file.etag)) response.status = 304;
    return response;
  }

  // Answers a request of /room, which pages of other origins may make if they may also open a session here.
  HttpResponse answer_page(const Request& request, const HttpRequest& question) {
    const std::string_view origin = view(request[http::field::origin]), host = view(request[http::field::host]);
    // A page that may not open a session may not learn either where the room is.
    if (request.count(http::field::origin) > 1 || router_->refuses_origin(origin, host, stream_->peer()))
      return refusal(403, "this server answers no pages of that origin; its setting transport.origins lists them");
    HttpResponse response;
    if (request.method() == http::verb::options)
      response.status = 204;
    else
      response = router_->service->handle(question);
    // The origin was checked above, so it may be repeated; "*" would let pages of every origin read the answer.
    response.allow_origin = origin;
    // A cache must not give one origin's answer to another.
    response.vary = "Origin";
    return response;
  }

  // Sends the response. Returns false when the peer has left or is too slow.
  asio::awaitable<bool> respond(const HttpResponse& response, const StaticFile& file, bool with_body, bool keep_alive) {
    const int kind = response.status / 100;
    (kind == 2   ? counters_->http_responses_2xx
     : kind == 3 ? counters_->http_responses_3xx
     : kind == 4 ? counters_->http_responses_4xx
                 : counters_->http_responses_5xx)
        .add();
    std::string piece = header_of(response, keep_alive, static_cast<std::int64_t>(std::time(nullptr)));
    // HEAD gets the header of GET, with the length of the body that does not follow.
    const bool body_follows = with_body && response.status != 304;
    if (body_follows) piece += response.body;
    std::uint64_t left = body_follows && response.body.empty() ? response.file_bytes : 0;
    for (std::uint64_t offset = 0;;) {
      // The first piece of a file leaves together with the header.
      if (left > 0) {
        const std::size_t before = piece.size();
        piece.resize(before + std::min<std::uint64_t>(left, kFilePieceBytes));
        const std::size_t count =
            file.read(offset, {reinterpret_cast<std::uint8_t*>(piece.data()) + before, piece.size() - before});
        // The file has become shorter than its announced size, so the response cannot be completed.
        if (count == 0) co_return false;
        piece.resize(before + count);
        offset += count;
        left -= count;
      }
      // The rate comes before the deadline, which is for the peer's reading alone.
      co_await wait_for_rate(piece.size());
      stream_->expires_after(options_->response_timeout);
      const auto [error, bytes] = co_await asio::async_write(*stream_, asio::buffer(piece), kAwaitable);
      counters_->bytes_written.add(bytes);
      counters_->sent_bytes_http.add(bytes);
      if (error) {
        stream_->close();
        co_return false;
      }
      if (left == 0) co_return true;
      piece.clear();
    }
  }

  // Waits until the connection may receive this many bytes of pages.
  asio::awaitable<void> wait_for_rate(std::size_t bytes) {
    // A piece larger than the bucket would wait forever.
    const double counted = std::min(static_cast<double>(bytes), options_->page_bytes_per_s);
    while (stream_->is_open() && !bytes_.take(counted, channel::monotonic_ns())) {
      counters_->pages_delayed.add();
      stream_->expires_after(options_->response_timeout);
      asio::steady_timer timer(stream_->get_executor(), kRateWait);
      co_await timer.async_wait(kAwaitable);
    }
  }

  // Returns the response that refuses the request's Host; none: the host is allowed.
  std::optional<HttpResponse> refuse_host(const Request& request) {
    const std::string_view host = view(request[http::field::host]);
    // A client without a Host is no browser: those always name one.
    if (host.empty()) return std::nullopt;
    // A client that is no page sends no Origin, and nobody's DNS has lured it here.
    const bool opens_session = websocket::is_upgrade(request) && request.count(http::field::origin) != 0;
    if (!router_->refuses_host(host, opens_session, stream_->peer())) return std::nullopt;
    return refusal(421, "this server has no such name; its setting transport.hosts lists them");
  }

  // Returns the response that refuses to open a WebSocket; none: the upgrade may go on.
  std::optional<HttpResponse> refuse_upgrade(const Request& request) {
    if (!websocket::is_upgrade(request)) {
      HttpResponse response = refusal(426, "here is a WebSocket");
      response.upgrade = "websocket";
      return response;
    }
    const std::string_view origin = view(request[http::field::origin]), host = view(request[http::field::host]);
    // Several origins count like one that is not allowed.
    const bool has_many = request.count(http::field::origin) > 1;
    if (router_->refuses_origin(has_many ? "many" : origin, host, stream_->peer()) || has_many) {
      return refusal(
          403, "this server takes no WebSocket from pages of that origin; its setting transport.origins lists them");
    }
    const std::string_view protocols = view(request[http::field::sec_websocket_protocol]);
    if (!protocols.empty() && !offers(protocols, WebSocketConnection::kSubprotocol)) {
      counters_->handshakes_failed_websocket.add();
      return refusal(400, "the subprotocol here is hairnet");
    }
    return std::nullopt;
  }

  // Makes the connection a WebSocket with a session. HTTP ends here.
  asio::awaitable<void> upgrade(const Request& request) {
    // Bytes behind the request belong to the WebSocket.
    stream_->put_back({static_cast<const std::uint8_t*>(buffer_.data().data()), buffer_.size()});
    // The WebSocket has deadlines of its own.
    stream_->expires_never();
    stream_->move_to(Admission::Place::session);
    auto connection = std::make_shared<WebSocketConnection>(stream_, *options_, *counters_);
    const bool with_subprotocol = request.count(http::field::sec_websocket_protocol) != 0;
    if (const auto error = co_await connection->accept(request, with_subprotocol)) {
      counters_->handshakes_failed_websocket.add();
      co_await stream_->close_gracefully();
      co_return;
    }
    if (router_->is_closed) {
      stream_->close();
      co_return;
    }
    counters_->connections_opened_websocket.add();
    PacketSink* sink = router_->open_session(connection, channel::monotonic_ns());
    connection->start(sink);
  }

  // The router owns the options and the counters, and this pointer keeps them alive.
  std::shared_ptr<ConnectionRouter> router_;
  std::shared_ptr<ByteStream> stream_;
  const TransportOptions* options_;
  TransportCounters* counters_;
  beast::flat_buffer buffer_;
  // Limits the bytes of pages of this connection.
  TokenBucket bytes_;
};

}  // namespace

asio::awaitable<void> serve_http(std::shared_ptr<ConnectionRouter> router, std::shared_ptr<ByteStream> stream) {
  HttpConnection connection(std::move(router), std::move(stream));
  co_await connection.run();
}

}  // namespace hairnet::server
