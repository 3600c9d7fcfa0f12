#include <boost/asio.hpp>
#include <utility>
#include <vector>

#include "client/link/server_stream.hpp"
#include "client/link/socket.hpp"

// Size-prefixed packets one after the other, over TCP or TLS.
namespace hairnet::link {
namespace {

using boost::system::error_code;

// One read takes at most this much; a larger packet arrives in several reads.
constexpr std::size_t kReadBytesMax = 64u << 10;

class PacketStream : public ServerStream {
 public:
  PacketStream(asio::io_context& io, StreamOptions options) : socket_(io, std::move(options)), buffer_(kReadBytesMax) {}

  asio::awaitable<std::string> open() override { return socket_.open(); }

  asio::awaitable<Read> read() override {
    error_code error;
    // One read takes what has arrived; the caller's splitter cuts it into packets.
    const std::size_t count =
        co_await socket_.async_read_some(asio::buffer(buffer_), asio::redirect_error(asio::use_awaitable, error));
    if (error) co_return Read{{}, socket_.describe(error)};
    co_return Read{{buffer_.data(), count}, {}};
  }

  // On a byte stream nothing is lost, so the mark of packets that may be lost is ignored.
  asio::awaitable<bool> write(std::span<const std::uint8_t> bytes, bool) override {
    error_code error;
    co_await asio::async_write(socket_, asio::buffer(bytes.data(), bytes.size()),
                               asio::redirect_error(asio::use_awaitable, error));
    co_return !error;
  }

  void half_close() override { socket_.half_close(); }
  void close() override { socket_.close(); }
  [[nodiscard]] bool has_messages() const override { return false; }
  [[nodiscard]] std::string_view transport() const override { return to_string(socket_.options().server.transport); }

 private:
  Socket socket_;
  std::vector<std::uint8_t> buffer_;
};

}  // namespace

std::unique_ptr<ServerStream> make_packet_stream(asio::io_context& io, StreamOptions options) {
  return std::make_unique<PacketStream>(io, std::move(options));
}

std::unique_ptr<ServerStream> make_server_stream(asio::io_context& io, StreamOptions options) {
  return options.server.web_socket() ? make_web_socket_stream(io, std::move(options))
                                     : make_packet_stream(io, std::move(options));
}

}  // namespace hairnet::link
