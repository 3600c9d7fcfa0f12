#pragma once

#include <boost/asio/any_completion_handler.hpp>
#include <boost/asio/any_io_executor.hpp>
#include <boost/asio/async_result.hpp>
#include <boost/asio/buffer.hpp>
#include <boost/container/static_vector.hpp>
#include <boost/system/error_code.hpp>
#include <cstddef>
#include <utility>

namespace hairnet {

// The stream operations that Asio and Beast need, of whatever is below: their handlers have one type here, so that HTTP
// and WebSockets are compiled once for plain sockets and TLS. One read and one write at a time. A read fills the first
// buffer that has room, and a write takes up to kWriteBuffersMax buffers: both may do a part of what is asked.
class AnyStream {
 public:
  using executor_type = boost::asio::any_io_executor;
  virtual executor_type get_executor() = 0;

  template <class Buffers, class Token>
  auto async_read_some(const Buffers& into, Token&& token) {
    return boost::asio::async_initiate<Token, void(boost::system::error_code, std::size_t)>(
        [this](auto handler, const Buffers& buffers) {
          boost::asio::mutable_buffer first;
          // An empty buffer in front would make the read return 0 bytes although there is room behind it.
          for (auto at = boost::asio::buffer_sequence_begin(buffers);
               first.size() == 0 && at != boost::asio::buffer_sequence_end(buffers); ++at)
            first = *at;
          read_some(first, std::move(handler));
        },
        token, into);
  }

  template <class Buffers, class Token>
  auto async_write_some(const Buffers& from, Token&& token) {
    return boost::asio::async_initiate<Token, void(boost::system::error_code, std::size_t)>(
        [this](auto handler, const Buffers& buffers) {
          WriteBuffers some;
          for (auto at = boost::asio::buffer_sequence_begin(buffers);
               at != boost::asio::buffer_sequence_end(buffers) && some.size() < kWriteBuffersMax; ++at)
            some.push_back(*at);
          write_some(some, std::move(handler));
        },
        token, from);
  }

 protected:
  static constexpr std::size_t kWriteBuffersMax = 16;
  using WriteBuffers = boost::container::static_vector<boost::asio::const_buffer, kWriteBuffersMax>;
  // One type for every handler is what lets HTTP and WebSockets be compiled once; it costs an allocation for some
  // operations.
  using Handler = boost::asio::any_completion_handler<void(boost::system::error_code, std::size_t)>;

  ~AnyStream() = default;
  virtual void read_some(boost::asio::mutable_buffer into, Handler handler) = 0;
  virtual void write_some(const WriteBuffers& from, Handler handler) = 0;
};

}  // namespace hairnet
