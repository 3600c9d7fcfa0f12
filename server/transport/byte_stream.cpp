#include "server/transport/byte_stream.hpp"

#include <netinet/tcp.h>

#include <array>
#include <utility>

#include "core/assert.hpp"
#include "server/transport/peer_address.hpp"

namespace hairnet::server {
namespace {

// Bytes that the system may buffer unsent. Its default is megabytes: a slow peer would then receive seconds of old
// frames instead of the newest ones from the outbox.
constexpr int kUnsentSystemBytes = 64 << 10;

// A peer that goes on sending after our end is read for this long and up to this many bytes; both bound what an
// attacker can make the server do after a refusal.
constexpr std::chrono::seconds kFinish{1};
constexpr std::size_t kFinishBytesMax = std::size_t{256} << 10;

// A socket option that Asio does not have: with it, a socket counts as writable only while fewer bytes than this are
// unsent.
using UnsentLow = asio::detail::socket_option::integer<IPPROTO_TCP, TCP_NOTSENT_LOWAT>;

}  // namespace

ByteStream::ByteStream(asio::ip::tcp::socket socket, const asio::ip::tcp::endpoint& peer, Admission::Ticket ticket,
                       TransportCounters& counters)
    : socket_(std::move(socket)), expiry_(socket_.get_executor()), ticket_(std::move(ticket)), counters_(&counters) {
  boost::system::error_code ignored;
  // A frame must leave now. Nagle's algorithm would hold it back until the previous one is acknowledged.
  socket_.set_option(asio::ip::tcp::no_delay(true), ignored);
  socket_.non_blocking(true, ignored);
  socket_.set_option(UnsentLow(kUnsentSystemBytes), ignored);
  set_peer(peer);
  counters_->connections_accepted.add();
}

ByteStream::~ByteStream() {
  counters_->connections_closed.add();
}

void ByteStream::set_peer(const asio::ip::tcp::endpoint& peer) {
  peer_ = shown(peer);
  network_ = network_of(peer.address());
}

void ByteStream::put_back(std::span<const std::uint8_t> bytes) {
  put_back_.insert(put_back_.begin(), bytes.begin(), bytes.end());
}

std::size_t ByteStream::write_now(std::span<const std::uint8_t> bytes) {
  HAIRNET_ASSERT(!tls_);
  // These bytes would overtake bytes that are corked.
  HAIRNET_ASSERT(!is_corked_ && corked_.empty());
  boost::system::error_code would_wait;
  return socket_.write_some(asio::buffer(bytes.data(), bytes.size()), would_wait);
}

void ByteStream::read_some(asio::mutable_buffer into, Handler handler) {
  if (!put_back_.empty()) {
    const std::size_t taken = asio::buffer_copy(into, asio::buffer(put_back_));
    put_back_.erase(put_back_.begin(), put_back_.begin() + static_cast<std::ptrdiff_t>(taken));
    // Asio's contract: a handler is never called from within the function that starts the operation.
    asio::post(get_executor(), asio::append(std::move(handler), boost::system::error_code(), taken));
  } else if (tls_) {
    tls_->async_read_some(into, std::move(handler));
  } else {
    socket_.async_read_some(into, std::move(handler));
  }
}

void ByteStream::write_some(const WriteBuffers& from, Handler handler) {
  // The first uncorked write still goes through the buffer, behind the bytes that are in it.
  if (is_corked_ || !corked_.empty()) {
    const std::size_t before = corked_.size(), bytes = asio::buffer_size(from);
    corked_.resize(before + bytes);
    asio::buffer_copy(asio::buffer(corked_.data() + before, bytes), from);
    write_corked(bytes, std::move(handler));
  } else if (tls_) {
    tls_->async_write_some(from, std::move(handler));
  } else {
    socket_.async_write_some(from, std::move(handler));
  }
}

void ByteStream::write_corked(std::size_t bytes, Handler handler) {
  if (is_corked_)
    return asio::post(get_executor(), asio::append(std::move(handler), boost::system::error_code(), bytes));
  leaving_.clear();
  std::swap(leaving_, corked_);
  // The handler gets the count of its own bytes only: earlier writers already got theirs.
  auto done = asio::bind_executor(get_executor(), [handler = std::move(handler), bytes](
                                                      const boost::system::error_code& error, std::size_t) mutable {
    std::move(handler)(error, error ? 0 : bytes);
  });
  if (tls_)
    asio::async_write(*tls_, asio::buffer(leaving_), std::move(done));
  else
    asio::async_write(socket_, asio::buffer(leaving_), std::move(done));
}

asio::awaitable<boost::system::error_code> ByteStream::accept_tls(asio::ssl::context& context) {
  HAIRNET_ASSERT(!tls_);
  tls_.emplace(socket_, context);
  // The ClientHello was read to detect the protocol, so the handshake gets its bytes from memory.
  const std::vector<std::uint8_t> first = std::exchange(put_back_, {});
  const auto [error, count] =
      co_await tls_->async_handshake(asio::ssl::stream_base::server, asio::buffer(first), kAwaitable);
  co_return error;
}

void ByteStream::expires_after(std::chrono::nanoseconds time) {
  expiry_.expires_after(time);
  // The timer holds a weak pointer: a stream that nobody uses any more must not live until its deadline.
  expiry_.async_wait([weak = weak_from_this(), turn = ++expiry_count_](const boost::system::error_code& error) {
    const auto self = weak.lock();
    if (error || !self || self->expiry_count_ != turn) return;
    self->has_expired_ = true;
    self->close();
  });
}

void ByteStream::expires_never() {
  ++expiry_count_;
  expiry_.cancel();
}

void ByteStream::close() {
  boost::system::error_code ignored;
  socket_.close(ignored);
  expires_never();
}

asio::awaitable<void> ByteStream::end_writing() {
  // TLS waits here for the peer to close its side; the caller has set a timeout.
  if (tls_) co_await tls_->async_shutdown(kAwaitable);
  boost::system::error_code ignored;
  socket_.shutdown(asio::ip::tcp::socket::shutdown_send, ignored);
}

asio::awaitable<void> ByteStream::close_gracefully() {
  // The caller may drop its pointer while this coroutine waits.
  const auto self = shared_from_this();
  if (!is_open()) co_return;
  expires_after(kFinish);
  co_await end_writing();
  std::array<std::uint8_t, 4096> away;
  // The bytes are read from the socket below TLS: nobody decrypts what nobody reads.
  for (std::size_t bytes = 0; is_open() && bytes < kFinishBytesMax;) {
    const auto [error, count] = co_await socket_.async_read_some(asio::buffer(away), kAwaitable);
    if (error) break;
    bytes += count;
  }
  close();
}

}  // namespace hairnet::server
