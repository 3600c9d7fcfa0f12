#pragma once

#include <algorithm>
#include <cstdint>

namespace hairnet::quic {

// When a connection that has nothing to send acknowledges the datagrams that have come. ngtcp2 does it after an
// eighth of the round trip, in packets of their own; a little later the acknowledgement goes along with a frame or a
// pose.
class AnswerDelay {
 public:
  // A tick at 30 Hz takes 33.3 ms, and a tick may come a little late.
  static constexpr std::int64_t kDelay_ns = 37'000'000;
  // A client's acknowledgements let the server's congestion window go on. So on a long line they wait less: round trip
  // and delay together are no longer than this, where poses 72 times a second still take them along.
  static constexpr std::int64_t kTogether_ns = 60'000'000, kDelay_ns_min = 15'000'000;
  static constexpr std::int64_t of_client(std::int64_t round_trip_ns) {
    return std::clamp(kTogether_ns - round_trip_ns, kDelay_ns_min, kDelay_ns);
  }
  // Peers are told this (max_ack_delay): kDelay_ns, and what a timer may come late.
  static constexpr std::int64_t kAnnouncedDelay_ns = 40'000'000;
  // So many datagrams are acknowledged at once: the peer's congestion window lives on it.
  static constexpr int kDatagramsMax = 8;

  // Applies from the next datagram or the next write on.
  void set_delay(std::int64_t delay_ns) { delay_ns_ = delay_ns; }
  void on_datagram(std::int64_t now_ns) {
    if (datagrams_++ == 0 && due_ns_ <= now_ns) due_ns_ = now_ns + delay_ns_;
  }
  // Something has come, or is to be said, that should not wait.
  void send_soon() { is_urgent_ = true; }
  // The connection was asked for all packets that it wants to send.
  void on_written(bool has_sent, std::int64_t now_ns) {
    // What is to be said has not been said yet.
    if (!has_sent && (is_urgent_ || datagrams_ > 0)) return;
    is_urgent_ = false;
    datagrams_ = 0;
    due_ns_ = now_ns + delay_ns_;
  }

  // Whether an idle connection need not write yet.
  [[nodiscard]] bool holds(std::int64_t now_ns) const {
    return !is_urgent_ && datagrams_ < kDatagramsMax && now_ns < due_ns_;
  }
  // When an idle connection is to be asked again, that would be at `expiry_ns` by itself.
  [[nodiscard]] std::int64_t due_ns(std::int64_t expiry_ns) const {
    return is_urgent_ || datagrams_ >= kDatagramsMax ? expiry_ns : std::max(expiry_ns, due_ns_);
  }

 private:
  std::int64_t delay_ns_ = kDelay_ns, due_ns_ = 0;
  // Counts the datagrams that came since something was sent.
  int datagrams_ = 0;
  bool is_urgent_ = false;
};

}  // namespace hairnet::quic
