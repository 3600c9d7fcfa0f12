#pragma once

#include <algorithm>
#include <cstdint>

namespace hairnet::quic {

// Decides when a connection that has nothing to send acknowledges the datagrams that have come. By itself ngtcp2 does
// so after an eighth of the round trip, in a packet of its own. A little later, the acknowledgement goes along with a
// frame or a pose.
class AnswerDelay {
 public:
  // The delay at a server. A tick at 30 Hz takes 33.3 ms and may come a little late, so by then a frame has taken the
  // acknowledgement along.
  static constexpr std::int64_t kDelay_ns = 37'000'000;
  // A client's acknowledgements let the server's congestion window go on, so on a long line they wait less. The round
  // trip and the delay together are at most kTogether_ns, but the delay is at least kDelay_ns_min, which poses at 72 Hz
  // (13.9 ms) still meet.
  static constexpr std::int64_t kTogether_ns = 60'000'000, kDelay_ns_min = 15'000'000;
  static constexpr std::int64_t of_client(std::int64_t round_trip_ns) {
    return std::clamp(kTogether_ns - round_trip_ns, kDelay_ns_min, kDelay_ns);
  }
  // The delay that peers are told (max_ack_delay): kDelay_ns, and the lateness of a timer.
  static constexpr std::int64_t kAnnouncedDelay_ns = 40'000'000;
  // When so many datagrams have come, they are acknowledged at once, since the peer's congestion window grows by
  // acknowledgements.
  static constexpr int kDatagramsMax = 8;

  // Sets the delay, from the next datagram or the next write on.
  void set_delay(std::int64_t delay_ns) { delay_ns_ = delay_ns; }
  void on_datagram(std::int64_t now_ns) {
    if (datagrams_++ == 0 && due_ns_ <= now_ns) due_ns_ = now_ns + delay_ns_;
  }
  // Something has come, or is to be sent, that should not wait.
  void send_soon() { is_urgent_ = true; }
  // The connection was asked for all packets that it wants to send, and has sent some or none.
  void on_written(bool has_sent, std::int64_t now_ns) {
    // The acknowledgement is still to be sent.
    if (!has_sent && (is_urgent_ || datagrams_ > 0)) return;
    is_urgent_ = false;
    datagrams_ = 0;
    due_ns_ = now_ns + delay_ns_;
  }

  // Whether an idle connection need not write yet.
  [[nodiscard]] bool holds(std::int64_t now_ns) const {
    return !is_urgent_ && datagrams_ < kDatagramsMax && now_ns < due_ns_;
  }
  // When an idle connection is to be asked again for packets. `expiry_ns` is when ngtcp2 itself would be asked.
  [[nodiscard]] std::int64_t due_ns(std::int64_t expiry_ns) const {
    return is_urgent_ || datagrams_ >= kDatagramsMax ? expiry_ns : std::max(expiry_ns, due_ns_);
  }

 private:
  // The delay now, and the time at which an acknowledgement that waits is due.
  std::int64_t delay_ns_ = kDelay_ns, due_ns_ = 0;
  // The datagrams that came since something was sent.
  int datagrams_ = 0;
  bool is_urgent_ = false;
};

}  // namespace hairnet::quic
