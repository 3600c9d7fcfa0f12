#include <boost/asio.hpp>
#include <boost/asio/ssl.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/ssl.hpp>
#include <boost/beast/websocket.hpp>
#include <boost/beast/websocket/ssl.hpp>
#include <chrono>
#include <utility>

#include "client/link/server_stream.hpp"
#include "client/link/socket.hpp"
#include "client/link/tls.hpp"
#include "schema/wire/messages.hpp"

// One binary message for each packet, over a WebSocket on TCP or TLS.
namespace hairnet::link {
namespace {

namespace beast = boost::beast;
namespace websocket = beast::websocket;
using asio::ip::tcp;
using boost::system::error_code;

template <class Socket>
class WebSocketStream : public ServerStream {
 public:
  asio::awaitable<std::string> open() override {
    std::string fault = co_await open_socket();
    if (fault.empty()) fault = co_await upgrade();
    co_return fault;
  }

  asio::awaitable<Read> read() override {
    buffer_.clear();
    error_code error;
    co_await stream_.async_read(buffer_, asio::redirect_error(asio::use_awaitable, error));
    if (error) co_return Read{{}, plain(error)};
    if (!stream_.got_binary()) co_return Read{{}, "the server sent text"};
    const auto bytes = buffer_.cdata();
    co_return Read{{static_cast<const std::uint8_t*>(bytes.data()), bytes.size()}, {}, true};
  }

  asio::awaitable<bool> write(std::span<const std::uint8_t> bytes, bool) override {
    error_code error;
    co_await stream_.async_write(asio::buffer(bytes.data(), bytes.size()),
                                 asio::redirect_error(asio::use_awaitable, error));
    co_return !error;
  }

  // Sends nothing: the link has already sent the protocol's own goodbye, and the server then closes.
  void half_close() override {
    error_code ignored;
    beast::get_lowest_layer(stream_).shutdown(tcp::socket::shutdown_send, ignored);
  }

  void close() override {
    lookup_.cancel();
    error_code ignored;
    beast::get_lowest_layer(stream_).close(ignored);
  }

  [[nodiscard]] bool has_messages() const override { return true; }
  [[nodiscard]] std::string_view transport() const override { return to_string(options_.server.transport); }

 protected:
  template <class... Arguments>
  explicit WebSocketStream(StreamOptions options, Arguments&&... socket)
      : options_(std::move(options)), stream_(std::forward<Arguments>(socket)...), lookup_(stream_.get_executor()) {}

  virtual asio::awaitable<std::string> open_socket() = 0;
  const StreamOptions options_;
  websocket::stream<Socket, false> stream_;  // without compression
  NameLookup lookup_;

 private:
  asio::awaitable<std::string> upgrade() {
    // No compression; a server that vanished is noticed by its pings.
    stream_.read_message_max(wire::kPacketBytesMax);
    stream_.binary(true);
    stream_.auto_fragment(false);
    auto patience = websocket::stream_base::timeout::suggested(beast::role_type::client);
    patience.idle_timeout = std::chrono::seconds(30);
    patience.keep_alive_pings = true;
    stream_.set_option(patience);
    stream_.set_option(websocket::stream_base::decorator([](websocket::request_type& request) {
      request.set(beast::http::field::sec_websocket_protocol, "hairnet");
      request.set(beast::http::field::user_agent, "hairnet");
    }));
    error_code error;
    websocket::response_type response;
    co_await stream_.async_handshake(response, options_.server.authority(), options_.server.path,
                                     asio::redirect_error(asio::use_awaitable, error));
    if (!error) co_return std::string();
    std::string why = error.message();
    if (error == websocket::error::upgrade_declined)
      why = "it answers " + std::to_string(response.result_int()) + " " + std::string(response.reason());
    co_return "no WebSocket at " + to_string(options_.server) + ": " + why;
  }

  [[nodiscard]] std::string plain(const error_code& error) const {
    if (error != websocket::error::closed) return describe_failure(error, options_.server);
    const std::string why(stream_.reason().reason.data(), stream_.reason().reason.size());
    return "the server closed the WebSocket without a goodbye" + (why.empty() ? why : ": " + why);
  }

  beast::flat_buffer buffer_;
};

class PlainWebSocket : public WebSocketStream<tcp::socket> {
 public:
  PlainWebSocket(asio::io_context& io, StreamOptions options) : WebSocketStream(std::move(options), io) {}

 private:
  asio::awaitable<std::string> open_socket() override {
    return connect_socket(stream_.next_layer(), lookup_, options_);
  }
};

// Members that TLS needs before its stream is constructed, and that must outlive the stream.
struct TlsBase {
  explicit TlsBase(const TlsOptions& options) : context(make_tls_context()), fault(configure(context, options)) {}
  asio::ssl::context context;
  const std::string fault;
};

class TlsWebSocket : private TlsBase, public WebSocketStream<TlsSocket> {
 public:
  TlsWebSocket(asio::io_context& io, StreamOptions options)
      : TlsBase(options.tls), WebSocketStream(std::move(options), io, context) {}

 private:
  asio::awaitable<std::string> open_socket() override {
    if (!TlsBase::fault.empty()) co_return TlsBase::fault;
    TlsSocket& socket = stream_.next_layer();
    std::string why_not = co_await connect_socket(socket.next_layer(), lookup_, options_);
    if (why_not.empty()) why_not = co_await tls_handshake(socket, options_);
    co_return why_not;
  }
};

}  // namespace

std::unique_ptr<ServerStream> make_web_socket_stream(asio::io_context& io, StreamOptions options) {
  if (options.server.encrypted()) return std::make_unique<TlsWebSocket>(io, std::move(options));
  return std::make_unique<PlainWebSocket>(io, std::move(options));
}

}  // namespace hairnet::link
