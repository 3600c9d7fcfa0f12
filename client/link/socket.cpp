#include "client/link/socket.hpp"

#include <netinet/tcp.h>
#include <sys/socket.h>

#include <boost/asio.hpp>
#include <boost/asio/ssl/error.hpp>

namespace hairnet::link {
namespace {

using asio::ip::tcp;
using boost::system::error_code;

// A small send buffer: a new pose waits behind everything that the kernel has not sent yet.
constexpr int kUnsentBytesMax = 64 << 10;
constexpr unsigned kUnacknowledgedMax_ms = 15'000;

// Limits what the kernel may buffer, and how long it waits for a peer that vanished. The link also works without these
// options, but less well.
void tune(tcp::socket& socket) {
  error_code ignored;
  socket.set_option(tcp::no_delay(true), ignored);
  setsockopt(socket.native_handle(), IPPROTO_TCP, TCP_NOTSENT_LOWAT, &kUnsentBytesMax, sizeof kUnsentBytesMax);
  setsockopt(socket.native_handle(), IPPROTO_TCP, TCP_USER_TIMEOUT, &kUnacknowledgedMax_ms,
             sizeof kUnacknowledgedMax_ms);
}

std::string name_of(const Address& address) {
  return address.host + ":" + std::to_string(address.port);
}

// Connects from the client's own address to the first of the server's addresses that is of the same kind.
asio::awaitable<void> connect_from(tcp::socket& socket, const asio::ip::address& local,
                                   const tcp::resolver::results_type& found, error_code& error) {
  error = asio::error::address_family_not_supported;
  for (const auto& entry : found) {
    if (entry.endpoint().address().is_v4() != local.is_v4()) continue;
    socket.open(entry.endpoint().protocol(), error);
    if (!error) {
      // Or an address would have ports for 28 000 connections a minute only.
      const asio::detail::socket_option::boolean<IPPROTO_IP, IP_BIND_ADDRESS_NO_PORT> port_later(true);
      error_code ignored;
      socket.set_option(port_later, ignored);
      socket.bind({local, 0}, error);
    }
    if (!error) co_await socket.async_connect(entry.endpoint(), asio::redirect_error(asio::use_awaitable, error));
    co_return;
  }
}

}  // namespace

asio::awaitable<std::string> connect_socket(tcp::socket& socket, NameLookup& lookup, const StreamOptions& options) {
  const Address& address = options.server;
  error_code error;
  const auto redirect = [&] { return asio::redirect_error(asio::use_awaitable, error); };
  const NameLookup::Found found = co_await lookup.find(address, error);
  if (error) co_return "cannot find " + name_of(address) + ": " + error.message();
  if (options.local)
    co_await connect_from(socket, *options.local, found, error);
  else
    co_await asio::async_connect(socket, found, redirect());
  if (error)
    co_return "cannot connect to " + name_of(address) + ": " + error.message() + "; is hairnet-server running there?";
  tune(socket);
  co_return std::string();
}

std::string describe_failure(const error_code& error, const Address& address) {
  if (error == asio::error::eof || error == asio::ssl::error::stream_truncated)
    return "the server closed the connection without a goodbye";
  return "the connection to " + name_of(address) + " broke: " + error.message();
}

}  // namespace hairnet::link
