#include "server/transport/sidecar_client.hpp"

#include <array>
#include <map>
#include <utility>

#include "server/transport/beast.hpp"
#include "server/transport/io_loop_core.hpp"

namespace hairnet::server {
namespace {

using Tcp = asio::ip::tcp;
using Error = boost::system::error_code;
using agones::SidecarError;

// Bounds connection, request and answer together. The caller's own time-out is shorter and comes first.
constexpr std::chrono::seconds kCallTimeout{5};

SidecarError error_of(const Error& error) {
  if (error == beast::error::timeout) return SidecarError::timeout;
  if (error == http::error::body_limit || error == http::error::header_limit || error == http::error::buffer_overflow)
    return SidecarError::oversize;
  const bool is_http = error.category() == http::make_error_code(http::error::bad_method).category();
  return is_http && error != http::error::end_of_stream && error != http::error::partial_message
             ? SidecarError::malformed
             : SidecarError::broken;
}

http::verb verb_of(agones::Request::Method method) {
  if (method == agones::Request::Method::get) return http::verb::get;
  return method == agones::Request::Method::post ? http::verb::post : http::verb::patch;
}

}  // namespace

// Coroutines share it, so a call under way outlives the client and finds `sink` null.
struct SidecarClient::Impl {
  Impl(SerialExecutor its_executor, std::uint16_t its_port) : executor(std::move(its_executor)), port(its_port) {}

  // Carries one call to the end of its answer.
  asio::awaitable<void> run(std::uint64_t id, agones::Request asked);
  // Tells the sink of a call that has failed, unless it was cancelled.
  void fail(std::uint64_t id, SidecarError error) {
    if (open.erase(id) > 0 && sink) sink->on_error(id, error, channel::monotonic_ns());
  }

  SerialExecutor executor;
  std::uint16_t port;
  agones::SidecarSink* sink = nullptr;
  // The calls under way, by their numbers, each with its connection.
  std::map<std::uint64_t, std::shared_ptr<beast::tcp_stream>> open;
};

asio::awaitable<void> SidecarClient::Impl::run(std::uint64_t id, agones::Request asked) {
  const auto found = open.find(id);
  if (found == open.end()) co_return;
  const std::shared_ptr<beast::tcp_stream> stream = found->second;
  stream->expires_after(kCallTimeout);
  // Addresses instead of the name localhost: a resolver could take longer than the call.
  const std::array<Tcp::endpoint, 2> loopback{Tcp::endpoint(asio::ip::address_v4::loopback(), port),
                                              Tcp::endpoint(asio::ip::address_v6::loopback(), port)};
  const auto [unconnected, endpoint] = co_await stream->async_connect(loopback, kAwaitable);
  if (unconnected)
    co_return fail(id, unconnected == beast::error::timeout ? SidecarError::timeout : SidecarError::unreachable);
  // cancel() was called meanwhile.
  if (!open.contains(id)) co_return;
  http::request<http::string_body> request(verb_of(asked.method), asked.path, 11);
  request.set(http::field::host, "localhost:" + std::to_string(port));
  request.set(http::field::content_type, "application/json");
  // A call every few seconds is not worth a kept connection, which the sidecar could close at any time.
  request.keep_alive(false);
  request.body() = std::move(asked.body);
  request.prepare_payload();
  const auto [unsent, sent_bytes] = co_await http::async_write(*stream, request, kAwaitable);
  if (unsent) co_return fail(id, error_of(unsent));
  http::response_parser<http::string_body> parser;
  // Anything on the machine may listen on the port, so its answer is bounded, too.
  parser.body_limit(agones::kAnswerBytesMax);
  beast::flat_buffer buffer(agones::kAnswerBytesMax);
  const auto [unread, read_bytes] = co_await http::async_read(*stream, buffer, parser, kAwaitable);
  if (unread) co_return fail(id, error_of(unread));
  if (open.erase(id) > 0 && sink)
    sink->on_answer(id, static_cast<int>(parser.get().result_int()), parser.get().body(), channel::monotonic_ns());
}

SidecarClient::SidecarClient(IoLoop& loop, std::uint16_t port)
    : impl_(std::make_shared<Impl>(loop.core().serial, port)) {}

SidecarClient::~SidecarClient() {
  impl_->sink = nullptr;
  for (auto& [id, stream] : impl_->open) stream->close();
}

void SidecarClient::set_sink(agones::SidecarSink* sink) {
  impl_->sink = sink;
}

void SidecarClient::send(std::uint64_t call, agones::Request request) {
  impl_->open[call] = std::make_shared<beast::tcp_stream>(impl_->executor);
  asio::co_spawn(
      impl_->executor,
      [impl = impl_, call, request = std::move(request)]() mutable -> asio::awaitable<void> {
        co_await asio::post(impl->executor, asio::use_awaitable);
        co_await impl->run(call, std::move(request));
      },
      asio::detached);
}

void SidecarClient::cancel(std::uint64_t call) {
  const auto found = impl_->open.find(call);
  if (found == impl_->open.end()) return;
  found->second->close();
  impl_->open.erase(found);
}

}  // namespace hairnet::server
