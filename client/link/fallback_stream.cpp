#include <boost/asio.hpp>
#include <chrono>
#include <utility>

#include "client/link/server_stream.hpp"
#include "schema/channel/monotonic_clock.hpp"

namespace hairnet::link {
namespace {

using boost::system::error_code;

// Tries WebTransport first, then the transport of the address, as make_fallback_stream() says.
class FallbackStream final : public ServerStream {
 public:
  FallbackStream(asio::io_context& io, StreamOptions options, std::shared_ptr<FallbackMemory> memory)
      : io_(&io), options_(std::move(options)), memory_(std::move(memory)), retry_(io) {}

  asio::awaitable<std::string> open() override {
    // After a blocked attempt a client does not wait the 3 s of kWebTransportWait again at each reconnect.
    if (!is_blocked()) {
      const auto attempt = make_web_transport_stream(*io_, options_);
      stream_ = attempt;
      auto [failure, error] = co_await open_in_time(attempt);
      if (is_closed_) co_return "closed";
      // A server that does not answer at all is not asked a second time by another transport.
      if (failure == WebTransportFailure::none || failure == WebTransportFailure::unreachable) co_return error;
      attempt->close();
      if (failure == WebTransportFailure::blocked) block();
      memory_->blocked_reason = std::move(error);
    }
    fallback_reason_ = memory_->blocked_reason;
    may_get_better_ = is_blocked();
    stream_ = make_server_stream(*io_, options_);
    co_return co_await stream_->open();
  }
  // Tries WebTransport again beside the open stream, whose packets go on meanwhile.
  asio::awaitable<std::shared_ptr<ServerStream>> better() override {
    while (may_get_better_ && !is_closed_) {
      retry_.expires_after(std::chrono::nanoseconds(memory_->blocked_until_ns - channel::monotonic_ns()));
      error_code ignored;
      co_await retry_.async_wait(asio::redirect_error(asio::use_awaitable, ignored));
      if (is_closed_) break;
      const auto attempt = make_web_transport_stream(*io_, options_);
      better_ = attempt;
      const Outcome outcome = co_await open_in_time(attempt);
      better_.reset();
      // A session that opens may not last, so the next try waits after a success, too.
      block();
      if (outcome.failure == WebTransportFailure::none && !is_closed_) co_return attempt;
      attempt->close();
    }
    co_return nullptr;
  }
  asio::awaitable<Read> read() override { return stream_->read(); }
  asio::awaitable<bool> write(std::span<const std::uint8_t> bytes, bool may_be_lost) override {
    return stream_->write(bytes, may_be_lost);
  }
  void half_close() override { stream_->half_close(); }
  void close() override {
    is_closed_ = true;
    retry_.cancel();
    if (stream_) stream_->close();
    if (better_) better_->close();
  }
  [[nodiscard]] bool has_messages() const override { return stream_->has_messages(); }
  [[nodiscard]] bool has_datagrams() const override { return stream_->has_datagrams(); }
  [[nodiscard]] std::string_view transport() const override { return stream_->transport(); }
  [[nodiscard]] std::string_view fallback_reason() const override { return fallback_reason_; }

 private:
  // The result of an attempt at WebTransport.
  struct Outcome {
    WebTransportFailure failure;
    // One line, or empty.
    std::string error;
  };

  [[nodiscard]] bool is_blocked() const { return channel::monotonic_ns() < memory_->blocked_until_ns; }
  void block() { memory_->blocked_until_ns = channel::monotonic_ns() + memory_->blocked_for.count(); }

  // Opens a session within kWebTransportWait. Closes the attempt when the time is over; open() then ends soon, with an
  // outcome that no longer counts.
  asio::awaitable<Outcome> open_in_time(std::shared_ptr<WebTransportAttempt> attempt) {
    asio::steady_timer timer(*io_, kWebTransportWait);
    // The handler must not keep the attempt alive: it may run after the attempt has ended.
    timer.async_wait([weak = std::weak_ptr(attempt)](const error_code& error) {
      const auto stream = weak.lock();
      if (!error && stream) stream->close();
    });
    std::string error = co_await attempt->open();
    WebTransportFailure failure = attempt->failure();
    // The timer has not run, so the attempt ended by itself and its own outcome counts.
    if (timer.cancel() > 0) co_return Outcome{failure, std::move(error)};
    const bool was_offered = failure == WebTransportFailure::none || failure == WebTransportFailure::blocked;
    co_return Outcome{was_offered ? WebTransportFailure::blocked : WebTransportFailure::absent,
                      "no WebTransport with " + options_.server.authority() + " within " +
                          std::to_string(kWebTransportWait / std::chrono::seconds(1)) + " s"};
  }

  // The io_context outlives the stream.
  asio::io_context* io_;
  const StreamOptions options_;
  const std::shared_ptr<FallbackMemory> memory_;
  asio::steady_timer retry_;
  // stream_ is the stream in use. better_ is an attempt at WebTransport beside it, while the attempt opens.
  std::shared_ptr<ServerStream> stream_, better_;
  std::string fallback_reason_;
  // may_get_better_: a blocked network was the reason for the fallback, so a later try may succeed.
  bool is_closed_ = false, may_get_better_ = false;
};

}  // namespace

std::unique_ptr<ServerStream> make_fallback_stream(asio::io_context& io, StreamOptions options,
                                                   std::shared_ptr<FallbackMemory> memory) {
  return std::make_unique<FallbackStream>(io, std::move(options), std::move(memory));
}

}  // namespace hairnet::link
