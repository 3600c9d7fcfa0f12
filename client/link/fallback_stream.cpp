#include <boost/asio.hpp>
#include <chrono>
#include <utility>

#include "client/link/server_stream.hpp"
#include "schema/channel/monotonic_clock.hpp"

namespace hairnet::link {
namespace {

using boost::system::error_code;

// So long after such an attempt, reconnects do without WebTransport.
constexpr std::int64_t kBlocked_ns = 60'000'000'000;

class FallbackStream final : public ServerStream {
 public:
  FallbackStream(asio::io_context& io, StreamOptions options, std::shared_ptr<FallbackMemory> memory)
      : io_(&io), options_(std::move(options)), memory_(std::move(memory)) {}

  asio::awaitable<std::string> open() override {
    if (channel::monotonic_ns() >= memory_->blocked_until_ns) {
      const auto attempt = make_web_transport_stream(*io_, options_);
      stream_ = attempt;
      asio::steady_timer timer(*io_, kWebTransportWait);
      timer.async_wait([weak = std::weak_ptr<ServerStream>(attempt)](const error_code& error) {
        const auto stream = weak.lock();
        if (!error && stream) stream->close();
      });
      std::string fault = co_await attempt->open();
      const bool is_in_time = timer.cancel() > 0;
      if (is_closed_) co_return "closed";
      const WebTransportFailure failure = attempt->failure();
      if (is_in_time && (fault.empty() || failure == WebTransportFailure::unreachable)) co_return fault;
      if (failure != WebTransportFailure::absent && failure != WebTransportFailure::unreachable)
        memory_->blocked_until_ns = channel::monotonic_ns() + kBlocked_ns;
      memory_->why_blocked = is_in_time ? std::move(fault)
                                        : "no WebTransport with " + options_.server.authority() + " within " +
                                              std::to_string(kWebTransportWait / std::chrono::seconds(1)) + " s";
      attempt->close();
    }
    fallback_reason_ = memory_->why_blocked;
    stream_ = make_server_stream(*io_, options_);
    co_return co_await stream_->open();
  }
  asio::awaitable<Read> read() override { return stream_->read(); }
  asio::awaitable<bool> write(std::span<const std::uint8_t> bytes, bool may_be_lost) override {
    return stream_->write(bytes, may_be_lost);
  }
  void half_close() override { stream_->half_close(); }
  void close() override {
    is_closed_ = true;
    if (stream_) stream_->close();
  }
  [[nodiscard]] bool has_messages() const override { return stream_->has_messages(); }
  [[nodiscard]] std::string_view transport() const override { return stream_->transport(); }
  [[nodiscard]] std::string_view fallback_reason() const override { return fallback_reason_; }

 private:
  asio::io_context* io_;
  const StreamOptions options_;
  const std::shared_ptr<FallbackMemory> memory_;
  std::shared_ptr<ServerStream> stream_;
  std::string fallback_reason_;
  bool is_closed_ = false;
};

}  // namespace

std::unique_ptr<ServerStream> make_fallback_stream(asio::io_context& io, StreamOptions options,
                                                   std::shared_ptr<FallbackMemory> memory) {
  return std::make_unique<FallbackStream>(io, std::move(options), std::move(memory));
}

}  // namespace hairnet::link
