#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <utility>
#include <vector>

namespace hairnet::quic {

// The datagrams of a connection that wait for its congestion window, and whether they go before the streams.
class DatagramQueue {
 public:
  // A server takes no more packets from its sessions while so many bytes wait. Frames that wait here get old, whereas
  // the session can still choose which of its own are worth sending.
  static constexpr std::size_t kBytesMax = std::size_t{8} << 10;
  // Datagrams go before streams, but at most so many in a row, so that a flood of them does not hold messages back.
  static constexpr int kInARowMax = 3;

  void push(std::vector<std::uint8_t> datagram) {
    bytes_ += datagram.size();
    waiting_.push_back(std::move(datagram));
  }
  void drop_first() {
    bytes_ -= waiting_.front().size();
    waiting_.pop_front();
  }
  [[nodiscard]] bool empty() const { return waiting_.empty(); }
  [[nodiscard]] std::size_t count() const { return waiting_.size(); }
  [[nodiscard]] std::size_t bytes() const { return bytes_; }
  [[nodiscard]] bool is_full() const { return bytes_ >= kBytesMax; }
  void clear() {
    waiting_.clear();
    bytes_ = 0;
  }

  // Whether a datagram is to be sent next. `streams_wait`: a stream has something to send.
  [[nodiscard]] bool is_next(bool streams_wait) const { return !empty() && (!streams_wait || in_a_row_ < kInARowMax); }
  [[nodiscard]] std::vector<std::uint8_t>& front() { return waiting_.front(); }
  // Takes the first datagram out as sent, so it counts towards kInARowMax. drop_first() does not count it.
  std::vector<std::uint8_t> pop() {
    std::vector<std::uint8_t> first = std::move(waiting_.front());
    waiting_.pop_front();
    bytes_ -= first.size();
    ++in_a_row_;
    return first;
  }
  void on_stream_sent() { in_a_row_ = 0; }

 private:
  std::deque<std::vector<std::uint8_t>> waiting_;
  std::size_t bytes_ = 0;
  // The datagrams since a stream was sent.
  int in_a_row_ = 0;
};

}  // namespace hairnet::quic
