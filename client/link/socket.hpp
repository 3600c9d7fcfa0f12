#pragma once

#include <boost/asio/append.hpp>
#include <boost/asio/awaitable.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/ssl/context.hpp>
#include <boost/asio/ssl/stream.hpp>
#include <boost/beast/core/role.hpp>
#include <optional>
#include <string>
#include <utility>

#include "client/link/name_lookup.hpp"
#include "client/link/server_stream.hpp"
#include "schema/stream/any_stream.hpp"

namespace hairnet::link {

// A socket to a server, plain or inside TLS as the address says. One thread.
class Socket : public AnyStream {
 public:
  Socket(asio::io_context& io, StreamOptions options);

  executor_type get_executor() override { return socket_.get_executor(); }
  [[nodiscard]] const StreamOptions& options() const { return options_; }
  // Returns the server's address. The socket must be open.
  [[nodiscard]] asio::ip::address remote_address() const;

  // Resolves and connects; with TLS, names the host to the server and checks its certificate. Once. Returns an empty
  // string, or one line with the reason of the failure.
  asio::awaitable<std::string> open();
  // Ends TCP's sending direction alone. A caller that reads on until the server closes gets all that the server has
  // sent, also inside TLS.
  void half_close();
  // Ends open() and other operations soon.
  void close();
  // Describes the end of the connection in one line.
  [[nodiscard]] std::string describe(const boost::system::error_code& error) const;

 private:
  void read_some(asio::mutable_buffer into, Handler handler) override;
  void write_some(const WriteBuffers& from, Handler handler) override;
  asio::awaitable<std::string> connect();
  asio::awaitable<std::string> shake_hands();

  const StreamOptions options_;
  asio::ip::tcp::socket socket_;
  std::optional<asio::ssl::context> context_;
  // Set once the socket is connected, for an address with TLS.
  std::optional<asio::ssl::stream<asio::ip::tcp::socket&>> tls_;
  NameLookup lookup_;
};

// Beast calls these to end the socket below a WebSocket. The first lets what is still on its way arrive in both
// directions; the socket closes later, with its stream. The second belongs to calls that block. Nobody makes these
// here, and nobody would read on after them, so it closes at once.
template <class Handler>
void async_teardown(boost::beast::role_type, Socket& socket, Handler&& handler) {
  socket.half_close();
  asio::post(socket.get_executor(), asio::append(std::forward<Handler>(handler), boost::system::error_code()));
}
inline void teardown(boost::beast::role_type, Socket& socket, boost::system::error_code& error) {
  error = {};
  socket.close();
}
inline void beast_close_socket(Socket& socket) {
  socket.close();
}

}  // namespace hairnet::link
