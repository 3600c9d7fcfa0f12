#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "server/transport/admission.hpp"
#include "server/transport/asio.hpp"
#include "server/transport/transport_counters.hpp"

namespace hairnet::server {

// A socket, plain or inside TLS, with the stream operations that Asio and Beast need: one read and one write at a time.
// Bytes that were read to detect the protocol can be put back. Reads and writes fail once the time of expires_after()
// has passed. Lives in a shared_ptr, on the loop's serial executor.
class ByteStream : public std::enable_shared_from_this<ByteStream> {
 public:
  using executor_type = asio::ip::tcp::socket::executor_type;

  ByteStream(asio::ip::tcp::socket socket, std::string peer, Admission::Ticket ticket, TransportCounters& counters);
  ~ByteStream();

  executor_type get_executor() { return socket_.get_executor(); }
  [[nodiscard]] const std::string& peer() const { return peer_; }
  [[nodiscard]] bool is_tls() const { return tls_.has_value(); }
  [[nodiscard]] bool is_open() const { return socket_.is_open(); }
  [[nodiscard]] bool is_from_loopback() const { return from_loopback_; }
  [[nodiscard]] bool has_expired() const { return has_expired_; }
  bool move_to(Admission::Place place) { return ticket_.move_to(place); }

  void put_back(std::span<const std::uint8_t> bytes);  // before the bytes that are read next
  asio::awaitable<boost::system::error_code> accept_tls(asio::ssl::context& context);

  void expires_after(std::chrono::nanoseconds time);
  void expires_never();
  // While the stream is corked, writes are buffered; the next uncorked write sends them all in one system call.
  void cork(bool corked) { is_corked_ = corked; }
  void close();
  // Ends writing, then reads and drops what the peer still sends for up to a second, then closes. A socket that is
  // closed with unread bytes resets the connection, and the peer would lose our last bytes.
  asio::awaitable<void> close_gracefully();
  // the first half of close_gracefully(): ends TLS, then the socket's sending direction
  asio::awaitable<void> end_writing();

  // Writes as many bytes as the system takes without waiting, and returns their number. Asserts that the stream is
  // plain; no write may be in progress. An error is ignored here: the next write meets the same error and reports it.
  std::size_t write_now(std::span<const std::uint8_t> bytes);

  template <class Buffers, class Token>
  auto async_read_some(const Buffers& into, Token&& token) {
    return asio::async_initiate<Token, void(boost::system::error_code, std::size_t)>(
        [this](auto handler, const Buffers& buffers) {
          if (const std::size_t taken = take_back(buffers))
            asio::post(get_executor(), asio::append(std::move(handler), boost::system::error_code(), taken));
          else if (tls_)
            tls_->async_read_some(buffers, std::move(handler));
          else
            socket_.async_read_some(buffers, std::move(handler));
        },
        token, into);
  }

  template <class Buffers, class Token>
  auto async_write_some(const Buffers& from, Token&& token) {
    return asio::async_initiate<Token, void(boost::system::error_code, std::size_t)>(
        [this](auto handler, const Buffers& buffers) {
          if (is_corked_ || !corked_.empty())
            write_corked(append_corked(buffers), std::move(handler));
          else if (tls_)
            tls_->async_write_some(buffers, std::move(handler));
          else
            socket_.async_write_some(buffers, std::move(handler));
        },
        token, from);
  }

 private:
  template <class Buffers>
  std::size_t take_back(const Buffers& into) {
    if (put_back_.empty()) return 0;
    const std::size_t taken = asio::buffer_copy(into, asio::buffer(put_back_));
    put_back_.erase(put_back_.begin(), put_back_.begin() + static_cast<std::ptrdiff_t>(taken));
    return taken;
  }
  template <class Buffers>
  std::size_t append_corked(const Buffers& from) {
    const std::size_t before = corked_.size(), bytes = asio::buffer_size(from);
    corked_.resize(before + bytes);
    asio::buffer_copy(asio::buffer(corked_.data() + before, bytes), from);
    return bytes;
  }
  template <class Handler>
  void write_corked(std::size_t bytes, Handler handler) {
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

  asio::ip::tcp::socket socket_;
  std::optional<asio::ssl::stream<asio::ip::tcp::socket&>> tls_;
  asio::steady_timer expiry_;
  std::string peer_;
  Admission::Ticket ticket_;
  TransportCounters* counters_;
  std::vector<std::uint8_t> put_back_, corked_, leaving_;
  std::uint64_t expiry_count_ = 0;  // counts timers, so that a cancelled one that already fired is ignored
  bool is_corked_ = false, has_expired_ = false, from_loopback_ = false;
};

}  // namespace hairnet::server
