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
  explicit PacketStream(Address address) : address_(std::move(address)), buffer_(kReadBytesMax) {}

  asio::awaitable<Read> read() override {
    error_code error;
    const std::size_t count =
        co_await socket().async_read_some(asio::buffer(buffer_), asio::redirect_error(asio::use_awaitable, error));
    if (error) co_return Read{{}, describe_failure(error, address_)};
    co_return Read{{buffer_.data(), count}, {}};
  }

  asio::awaitable<bool> write(std::span<const std::uint8_t> bytes) override {
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
    error_code ignored;
    socket().lowest_layer().close(ignored);
  }

  [[nodiscard]] bool has_messages() const override { return false; }

 protected:
  virtual Socket& socket() = 0;
  const Address address_;

 private:
  std::vector<std::uint8_t> buffer_;
};

class PlainStream : public PacketStream<tcp::socket> {
 public:
  PlainStream(asio::io_context& io, Address address) : PacketStream(std::move(address)), socket_(io) {}
  asio::awaitable<std::string> open() override { return connect_socket(socket_, address_); }

 private:
  tcp::socket& socket() override { return socket_; }
  tcp::socket socket_;
};

class TlsStream : public PacketStream<TlsSocket> {
 public:
  TlsStream(asio::io_context& io, Address address, TlsOptions options)
      : PacketStream(std::move(address)),
        options_(std::move(options)),
        context_(make_tls_context()),
        fault_(configure(context_, options_)),
        socket_(io, context_) {}

  asio::awaitable<std::string> open() override {
    if (!fault_.empty()) co_return fault_;
    std::string fault = co_await connect_socket(socket_.next_layer(), address_);
    if (fault.empty()) fault = co_await tls_handshake(socket_, address_, options_);
    co_return fault;
  }

 private:
  TlsSocket& socket() override { return socket_; }
  const TlsOptions options_;
  asio::ssl::context context_;
  const std::string fault_;
  TlsSocket socket_;
};

}  // namespace

std::unique_ptr<ServerStream> make_packet_stream(asio::io_context& io, const Address& address, const TlsOptions& tls) {
  if (address.encrypted()) return std::make_unique<TlsStream>(io, address, tls);
  return std::make_unique<PlainStream>(io, address);
}

std::unique_ptr<ServerStream> make_server_stream(asio::io_context& io, const Address& address, const TlsOptions& tls) {
  return address.web_socket() ? make_web_socket_stream(io, address, tls) : make_packet_stream(io, address, tls);
}

}  // namespace hairnet::link
