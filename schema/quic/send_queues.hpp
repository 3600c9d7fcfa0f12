#pragma once

#include <ngtcp2/ngtcp2.h>

#include <cstddef>
#include <cstdint>
#include <map>
#include <span>
#include <utility>
#include <vector>

#include "schema/quic/datagram_queue.hpp"
#include "schema/quic/send_buffer.hpp"

namespace hairnet::quic {

// Learns what becomes of streams and datagrams while packets are written.
class SendObserver {
 public:
  virtual ~SendObserver() = default;
  virtual void on_stream_sent(std::int64_t stream, std::size_t bytes) = 0;
  // False means that the datagram was dropped, since the peer or the path does not take it.
  virtual void on_datagram_sent(std::size_t bytes, bool is_sent) = 0;
  // The peer reads no more of the stream; what waited there is dropped. False ends the connection.
  virtual bool on_stopped(std::int64_t stream) = 0;
};

// What a connection has to send: datagrams and the bytes of its streams. Datagrams go first, except that every fourth
// packet may be a stream's. Among the streams bulk ones go last, except that every fourth piece may be theirs, and they
// take turns.
class SendQueues {
 public:
  // Makes the stream if it is not there.
  SendBuffer& stream(std::int64_t id) { return streams_[id]; }
  SendBuffer& add_bulk_stream(std::int64_t id);
  [[nodiscard]] SendBuffer* find(std::int64_t id);
  [[nodiscard]] const SendBuffer* find(std::int64_t id) const;
  void erase(std::int64_t id);
  void push_datagram(std::vector<std::uint8_t> bytes) { datagrams_.push(std::move(bytes)); }
  // Each datagram begins with this prefix.
  void set_datagram_prefix(std::vector<std::uint8_t> prefix) { datagram_prefix_ = std::move(prefix); }
  void drop_first_datagram() { datagrams_.drop_first(); }
  void drop_datagrams() { datagrams_.clear(); }
  void clear();

  // Writes the next packet into `room`. Returns its bytes, 0 when nothing can be sent now, or the negative code of an
  // error.
  ngtcp2_ssize write(ngtcp2_conn* quic, ngtcp2_path& path, ngtcp2_pkt_info& info, std::span<std::uint8_t> room,
                     std::int64_t now_ns, SendObserver& observer);

  [[nodiscard]] std::size_t datagram_count() const { return datagrams_.count(); }
  [[nodiscard]] const DatagramQueue& datagrams() const { return datagrams_; }
  [[nodiscard]] std::size_t unsent_bytes() const;
  // The bytes of all streams that are unsent or not acknowledged.
  [[nodiscard]] std::size_t kept_bytes() const;
  [[nodiscard]] std::size_t bulk_kept_bytes() const;
  [[nodiscard]] bool is_bulk(std::int64_t id) const;
  // Whether nothing waits to be sent, or for its acknowledgement.
  [[nodiscard]] bool is_idle() const;

 private:
  // The most pieces of other streams before a bulk stream that waits gets one.
  static constexpr int kInARowMax = 3;

  // Returns the stream to write next, of those that `blocked` does not name; -1 means none.
  [[nodiscard]] std::int64_t next_stream(std::span<const std::int64_t> blocked) const;
  void on_stream_sent(std::int64_t id);

  std::map<std::int64_t, SendBuffer> streams_;
  // The bulk streams; the one whose turn is next comes first.
  std::vector<std::int64_t> bulk_;
  // The pieces of other streams since one of a bulk stream.
  int in_a_row_ = 0;
  DatagramQueue datagrams_;
  std::vector<std::uint8_t> datagram_prefix_;
};

}  // namespace hairnet::quic
