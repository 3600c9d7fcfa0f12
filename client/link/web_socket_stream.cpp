#include <boost/asio.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/websocket.hpp>
#include <chrono>
#include <utility>

#include "client/link/server_stream.hpp"
#include "client/link/socket.hpp"
#include "schema/wire/messages.hpp"

// One binary message for each packet, over a WebSocket on TCP or TLS.
namespace hairnet::link {
namespace {

namespace beast = boost::beast;
namespace websocket = beast::websocket;
using boost::system::error_code;

class WebSocketStream : public ServerStream {
 public:
  WebSocketStream(asio::io_context& io, StreamOptions options) : stream_(io, std::move(options)) {}

  asio::awaitable<std::string> open() override {
    std::string error = co_await socket().open();
    if (error.empty()) error = co_await upgrade();
    co_return error;
  }

  asio::awaitable<Read> read() override {
    buffer_.clear();
    error_code error;
    co_await stream_.async_read(buffer_, asio::redirect_error(asio::use_awaitable, error));
    if (error) co_return Read{{}, plain(error)};
    // The protocol has binary messages alone.
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
  void half_close() override { socket().half_close(); }
  void close() override { socket().close(); }

  [[nodiscard]] bool has_messages() const override { return true; }
  [[nodiscard]] std::string_view transport() const override { return to_string(socket().options().server.transport); }

 private:
  Socket& socket() { return stream_.next_layer(); }
  [[nodiscard]] const Socket& socket() const { return stream_.next_layer(); }

  asio::awaitable<std::string> upgrade() {
    // A longer message cannot be a packet; the stream fails before it takes memory for one.
    stream_.read_message_max(wire::kPacketBytesMax);
    stream_.binary(true);
    // One packet is one message, and one message one frame: pieces would only add headers.
    stream_.auto_fragment(false);
    auto patience = websocket::stream_base::timeout::suggested(beast::role_type::client);
    // A silent connection is pinged, and ends after 30 s without an answer: a server that vanished is noticed so.
    patience.idle_timeout = std::chrono::seconds(30);
    patience.keep_alive_pings = true;
    stream_.set_option(patience);
    stream_.set_option(websocket::stream_base::decorator([](websocket::request_type& request) {
      request.set(beast::http::field::sec_websocket_protocol, "hairnet");
      request.set(beast::http::field::user_agent, "hairnet");
    }));
    const Address& server = socket().options().server;
    error_code error;
    websocket::response_type response;
    co_await stream_.async_handshake(response, server.authority(), server.path,
                                     asio::redirect_error(asio::use_awaitable, error));
    if (!error) co_return std::string();
    std::string reason = error.message();
    if (error == websocket::error::upgrade_declined)
      reason = "it answers " + std::to_string(response.result_int()) + " " + std::string(response.reason());
    co_return "no WebSocket at " + to_string(server) + ": " + reason;
  }

  [[nodiscard]] std::string plain(const error_code& error) const {
    if (error != websocket::error::closed) return socket().describe(error);
    const std::string reason(stream_.reason().reason.data(), stream_.reason().reason.size());
    return "the server closed the WebSocket without a goodbye" + (reason.empty() ? reason : ": " + reason);
  }

  // The `false` leaves compression out.
  websocket::stream<Socket, false> stream_;
  beast::flat_buffer buffer_;
};

}  // namespace

std::unique_ptr<ServerStream> make_web_socket_stream(asio::io_context& io, StreamOptions options) {
  return std::make_unique<WebSocketStream>(io, std::move(options));
}

}  // namespace hairnet::link
