#include "client/link/tcp_stream.hpp"

#include <netinet/tcp.h>
#include <sys/socket.h>

#include <boost/asio.hpp>
#include <utility>

namespace hairnet::link {
namespace {

using asio::ip::tcp;
using boost::system::error_code;

// A pose waits for what the kernel holds unsent: it is kept small.
constexpr int kUnsentBytesMax = 64 << 10;
constexpr unsigned kUnacknowledgedMax_ms = 15'000;
constexpr std::size_t kReadBytesMax = 64u << 10;

// What the kernel may hold back, and how long it waits for a peer that vanished. Without these it works less well.
void tune(tcp::socket& socket) {
  error_code ignored;
  socket.set_option(tcp::no_delay(true), ignored);
  setsockopt(socket.native_handle(), IPPROTO_TCP, TCP_NOTSENT_LOWAT, &kUnsentBytesMax, sizeof kUnsentBytesMax);
  setsockopt(socket.native_handle(), IPPROTO_TCP, TCP_USER_TIMEOUT, &kUnacknowledgedMax_ms,
             sizeof kUnacknowledgedMax_ms);
}

}  // namespace

asio::awaitable<std::string> connect_socket(tcp::socket& socket, const Address& address) {
  error_code error;
  const auto redirect = [&] { return asio::redirect_error(asio::use_awaitable, error); };
  const std::string name = address.host + ":" + std::to_string(address.port);
  tcp::resolver resolver(socket.get_executor());
  const auto found = co_await resolver.async_resolve(address.host, std::to_string(address.port), redirect());
  if (error) co_return "cannot find " + name + ": " + error.message();
  co_await asio::async_connect(socket, found, redirect());
  if (error) co_return "cannot connect to " + name + ": " + error.message();
  tune(socket);
  co_return std::string();
}

std::string plain_fault(const error_code& error, const Address& address) {
  if (error == asio::error::eof) return "the server closed the connection without a goodbye";
  return "the connection to " + address.host + ":" + std::to_string(address.port) + " broke: " + error.message();
}

TcpStream::TcpStream(asio::io_context& io, Address address)
    : address_(std::move(address)), socket_(io), buffer_(kReadBytesMax) {}

asio::awaitable<std::string> TcpStream::open() {
  return connect_socket(socket_, address_);
}

asio::awaitable<ServerStream::Read> TcpStream::read() {
  error_code error;
  const std::size_t count =
      co_await socket_.async_read_some(asio::buffer(buffer_), asio::redirect_error(asio::use_awaitable, error));
  if (error) co_return Read{{}, plain_fault(error, address_)};
  co_return Read{{buffer_.data(), count}, {}};
}

asio::awaitable<bool> TcpStream::write(std::span<const std::uint8_t> bytes) {
  error_code error;
  co_await asio::async_write(socket_, asio::buffer(bytes.data(), bytes.size()),
                             asio::redirect_error(asio::use_awaitable, error));
  co_return !error;
}

void TcpStream::half_close() {
  error_code ignored;
  socket_.shutdown(tcp::socket::shutdown_send, ignored);
}

void TcpStream::close() {
  error_code ignored;
  socket_.close(ignored);
}

std::unique_ptr<ServerStream> make_server_stream(asio::io_context& io, const Address& address, const TlsOptions&) {
  return std::make_unique<TcpStream>(io, address);
}

}  // namespace hairnet::link
