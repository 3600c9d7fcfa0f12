#include <boost/asio.hpp>
#include <boost/asio/ssl.hpp>
#include <utility>
#include <vector>

#include "client/link/server_stream.hpp"
#include "client/link/socket.hpp"
#include "client/link/tls.hpp"

// Size-prefixed packets one after the other, over TCP or TLS.
namespace hairnet::link {
namespace {

using asio::ip::tcp;
using boost::system::error_code;

constexpr std::size_t kReadBytesMax = 64u << 10;

template <class Socket>
class PacketStream : public ServerStream {
 public:
  PacketStream(asio::io_context& io, StreamOptions options)
      : options_(std::move(options)), lookup_(io.get_executor()), buffer_(kReadBytesMax) {}

  asio::awaitable<Read> read() override {
    error_code error;
    const std::size_t count =
        co_await socket().async_read_some(asio::buffer(buffer_), asio::redirect_error(asio::use_awaitable, error));
    if (error) co_return Read{{}, describe_failure(error, options_.server)};
    co_return Read{{buffer_.data(), count}, {}};
  }

  asio::awaitable<bool> write(std::span<const std::uint8_t> bytes, bool) override {
    error_code error;
    co_await asio::async_write(socket(), asio::buffer(bytes.data(), bytes.size()),
                               asio::redirect_error(asio::use_awaitable, error));
    co_return !error;
  }

  // Does not half-close TLS: the link reads until the server closes, and the goodbye tells the server to do so.
  void half_close() override {
    error_code ignored;
    socket().lowest_layer().shutdown(tcp::socket::shutdown_send, ignored);
  }

  void close() override {
    lookup_.cancel();
    error_code ignored;
    socket().lowest_layer().close(ignored);
  }

  [[nodiscard]] bool has_messages() const override { return false; }
  [[nodiscard]] std::string_view transport() const override { return to_string(options_.server.transport); }

 protected:
  virtual Socket& socket() = 0;
  const StreamOptions options_;
  NameLookup lookup_;

 private:
  std::vector<std::uint8_t> buffer_;
};

class PlainStream : public PacketStream<tcp::socket> {
 public:
  PlainStream(asio::io_context& io, StreamOptions options) : PacketStream(io, std::move(options)), socket_(io) {}
  asio::awaitable<std::string> open() override { return connect_socket(socket_, lookup_, options_); }

 private:
  tcp::socket& socket() override { return socket_; }
  tcp::socket socket_;
};

class TlsStream : public PacketStream<TlsSocket> {
 public:
  TlsStream(asio::io_context& io, StreamOptions options)
      : PacketStream(io, std::move(options)),
        context_(make_tls_context()),
        fault_(configure(context_, options_.tls)),
        socket_(io, context_) {}

  asio::awaitable<std::string> open() override {
    if (!fault_.empty()) co_return fault_;
    std::string fault = co_await connect_socket(socket_.next_layer(), lookup_, options_);
    if (fault.empty()) fault = co_await tls_handshake(socket_, options_);
    co_return fault;
  }

 private:
  TlsSocket& socket() override { return socket_; }
  asio::ssl::context context_;
  const std::string fault_;
  TlsSocket socket_;
};

}  // namespace

std::unique_ptr<ServerStream> make_packet_stream(asio::io_context& io, StreamOptions options) {
  if (options.server.encrypted()) return std::make_unique<TlsStream>(io, std::move(options));
  return std::make_unique<PlainStream>(io, std::move(options));
}

std::unique_ptr<ServerStream> make_server_stream(asio::io_context& io, StreamOptions options) {
  return options.server.web_socket() ? make_web_socket_stream(io, std::move(options))
                                     : make_packet_stream(io, std::move(options));
}

}  // namespace hairnet::link
