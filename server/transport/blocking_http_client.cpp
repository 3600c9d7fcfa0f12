#include "server/transport/blocking_http_client.hpp"

#include <algorithm>
#include <atomic>
#include <utility>

#include "server/transport/http_peer.hpp"
#include "server/transport/tls_context.hpp"

namespace hairnet::server {
namespace {

using Error = boost::system::error_code;

// The bound of bytes that are read and not parsed yet, and so of an answer's header.
constexpr std::size_t kBufferBytesMax = 64 << 10;
// The bound of a body that was not asked for, such as the text of an error.
constexpr std::size_t kErrorBytesMax = 64 << 10;

http::verb verb_of(ExchangeRequest::Method method) {
  switch (method) {
    case ExchangeRequest::Method::get:
      return http::verb::get;
    case ExchangeRequest::Method::head:
      return http::verb::head;
    case ExchangeRequest::Method::put:
      break;
  }
  return http::verb::put;
}

ExchangeError exchange_error_of(const Error& error) {
  if (error == beast::error::timeout) return ExchangeError::timeout;
  if (error == http::error::body_limit) return ExchangeError::oversize;
  const bool is_http = error.category() == http::make_error_code(http::error::bad_method).category();
  return is_http && error != http::error::end_of_stream && error != http::error::partial_message
             ? ExchangeError::malformed
             : ExchangeError::broken;
}

}  // namespace

struct BlockingHttpClient::Impl {
  explicit Impl(BlockingHttpClientDef its_def) : def(std::move(its_def)) {}

  // Carries one call: connects if no connection is kept, and tries again once where the kept one has broken.
  asio::awaitable<void> run(const ExchangeRequest& asked, std::size_t body_bytes_max, ExchangeAnswer& answer);
  // Sends the request on `peer` and reads the answer.
  asio::awaitable<Error> exchange(const ExchangeRequest& asked, std::size_t body_bytes_max, ExchangeAnswer& answer);
  // The time that a message of this size may take.
  [[nodiscard]] std::chrono::milliseconds time_for(std::uint64_t bytes) const {
    return def.exchange_timeout + def.mib_timeout * static_cast<std::int64_t>(bytes >> 20);
  }

  BlockingHttpClientDef def;
  std::shared_ptr<asio::ssl::context> tls;
  asio::io_context loop{1};
  // The connection; null: there is none.
  std::unique_ptr<HttpPeer> peer;
  // The last answer allows the connection to be used again.
  bool is_kept = false;
  // cancel() was called, on any thread. The flag stays set.
  std::atomic<bool> cancelled{false};
};

asio::awaitable<Error> BlockingHttpClient::Impl::exchange(const ExchangeRequest& asked, std::size_t body_bytes_max,
                                                          ExchangeAnswer& answer) {
  http::request<http::span_body<const std::uint8_t>> request(verb_of(asked.method), asked.target, 11);
  for (const auto& [name, value] : asked.fields) request.insert(name, value);
  request.body() = {asked.body.data(), asked.body.size()};
  request.prepare_payload();
  peer->expires_after(time_for(asked.body.size()));
  // A server may refuse a request, and stop reading, before it has all of it.
  const Error unwritten = co_await peer->write(request);
  if (unwritten == beast::error::timeout) co_return unwritten;

  http::response_parser<http::vector_body<std::uint8_t>> parser;
  // An answer to HEAD announces a length and has no body.
  parser.skip(asked.method == ExchangeRequest::Method::head);
  parser.body_limit(std::max(body_bytes_max, kErrorBytesMax));
  const Error unread = co_await peer->read_header(parser);
  if (!unread || unread == http::error::body_limit) answer.status = parser.get().result_int();
  // The first error names the cause; a server that refuses early breaks the write and still answers.
  if (unread) co_return unwritten ? unwritten : unread;
  const bool is_body_wanted = asked.method == ExchangeRequest::Method::get && answer.status == 200;
  const std::size_t limit = is_body_wanted ? body_bytes_max : kErrorBytesMax;
  // The announced length is refused before a byte of the body has been read.
  const auto length = parser.content_length();
  if (asked.method != ExchangeRequest::Method::head && length && *length > limit)
    co_return http::make_error_code(http::error::body_limit);
  parser.body_limit(limit);
  if (is_body_wanted) peer->expires_after(time_for(length ? *length : limit));
  if (const Error error = co_await peer->read(parser)) co_return error;
  is_kept = !unwritten && parser.get().keep_alive();
  answer.body = std::move(parser.get().body());
  co_return Error();
}

asio::awaitable<void> BlockingHttpClient::Impl::run(const ExchangeRequest& asked, std::size_t body_bytes_max,
                                                    ExchangeAnswer& answer) {
  // The kept connection may have been closed by the server meanwhile: then a new one is tried.
  for (bool is_reused = peer != nullptr;; is_reused = false) {
    answer = {};
    if (!is_reused) {
      peer = std::make_unique<HttpPeer>(loop.get_executor(), tls.get(), kBufferBytesMax);
      if (const Error error = co_await peer->connect(def.host, def.port, def.connect_timeout)) {
        peer.reset();
        answer.error = error == beast::error::timeout ? ExchangeError::timeout : ExchangeError::unreachable;
        answer.detail = error.message();
        break;
      }
    }
    is_kept = false;
    Error error = asio::error::operation_aborted;
    // cancel() may have come while the connection was being made, when there was no exchange to end.
    if (!cancelled) error = co_await exchange(asked, body_bytes_max, answer);
    if (!is_kept) peer.reset();
    if (!error) break;
    answer.error = exchange_error_of(error);
    answer.detail = error.message();
    // A new connection that breaks is an error of the server, and no second try would be different.
    if (!is_reused || answer.error != ExchangeError::broken || cancelled) break;
  }
  if (cancelled) answer.error = ExchangeError::cancelled;
}

Result<std::unique_ptr<BlockingHttpClient>> BlockingHttpClient::create(const BlockingHttpClientDef& def) {
  auto impl = std::make_unique<Impl>(def);
  if (def.is_tls) {
    auto context = make_client_tls_context(def.ca, def.whose);
    if (!context) return Refusal(context.error());
    impl->tls = std::move(*context);
  }
  return std::unique_ptr<BlockingHttpClient>(new BlockingHttpClient(std::move(impl)));
}

BlockingHttpClient::BlockingHttpClient(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}

BlockingHttpClient::~BlockingHttpClient() = default;

ExchangeAnswer BlockingHttpClient::call(const ExchangeRequest& request, std::size_t body_bytes_max) {
  ExchangeAnswer answer;
  if (impl_->cancelled) {
    answer.error = ExchangeError::cancelled;
    return answer;
  }
  // run() leaves the loop stopped when nothing is left to do.
  impl_->loop.restart();
  asio::co_spawn(impl_->loop, impl_->run(request, body_bytes_max, answer), asio::detached);
  impl_->loop.run();
  return answer;
}

void BlockingHttpClient::cancel() {
  impl_->cancelled = true;
  // The peer belongs to the thread that runs the loop. Without a call under way the task waits for the next one, which
  // ends at once in any case.
  asio::post(impl_->loop, [impl = impl_.get()] {
    if (impl->peer) impl->peer->close();
  });
}

}  // namespace hairnet::server
