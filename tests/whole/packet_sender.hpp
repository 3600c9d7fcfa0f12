#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <span>
#include <vector>

#include "schema/quic/answer_delay.hpp"
#include "tests/whole/path.hpp"

namespace hairnet::whole {

// How a sender notices losses and how fast it recovers.
struct Recovery {
  // A time-out lasts at least so long.
  std::int64_t timeout_min_ns = 0;
  // A time-out is the round trip, four times its deviation, and this time.
  std::int64_t timeout_more_ns = 0;
  // So many packets are sent after a time-out.
  int probes = 1;
  // The first time-out comes after two round trips.
  bool has_tail_probe = false;
  // The second time-out in a row counts all packets on the way as lost.
  bool timeout_loses_all = false;
  // After a loss the congestion window grows by so many packets in each round trip.
  double growth = 0.53;
  // The window grows also while the sender does not need it.
  bool grows_unused = false;
  // The receiver lets acknowledgements of datagrams wait, as clients do.
  bool answers_late = false;

  // TCP as in Linux: RACK, a tail loss probe, then a time-out (RTO) of 200 ms or more. A growth of 0.53 packets is the
  // smallest of CUBIC (RFC 9438, its Reno-friendly region with a reduction to 0.7).
  static Recovery tcp() { return {.timeout_min_ns = 200 * kMs, .has_tail_probe = true, .timeout_loses_all = true}; }
  // RFC 9002, with the two probes of ngtcp2. The growth is such that the window is the one of ngtcp2 at 5 % loss
  // (tests/unit/server/quic_pace_test.cpp).
  static Recovery quic() {
    return {.timeout_more_ns = quic::AnswerDelay::kAnnouncedDelay_ns,
            .probes = 2,
            .growth = 2,
            .grows_unused = true,
            .answers_late = true};
  }
};

// One direction of a connection over paths that lose packets: segments, which are sent again and arrive in order, and
// datagrams, which are not. A model of TCP's and QUIC's loss recovery and congestion control (Reno with CUBIC's
// factors), without handshakes; acknowledgements are packets of their own, which may get lost too.
class PacketSender : public std::enable_shared_from_this<PacketSender> {
 public:
  // The largest payload of a packet.
  static constexpr std::size_t kPacketBytes = 1200;
  // The bytes that the headers of IP, UDP or TCP, and QUIC add to a packet.
  static constexpr std::size_t kOverheadBytes = 60;

  // `forth` carries packets, `back` their acknowledgements.
  PacketSender(Timeline& timeline, const Recovery& recovery, Path forth, Path back)
      : timeline_(&timeline), recovery_(recovery), forth_(std::move(forth)), back_(std::move(back)) {}

  // Whether the congestion window has room.
  [[nodiscard]] bool may_send() const;
  void send_segment(std::vector<std::uint8_t> bytes);
  void send_datagram(std::vector<std::uint8_t> bytes);
  // Returns the rate that the congestion window allows; 0 before the first round trip was measured.
  [[nodiscard]] double bytes_per_s() const;
  // The bytes of segments that are not acknowledged.
  [[nodiscard]] std::size_t kept_bytes() const { return kept_bytes_; }

  // They are called at the receiver, for segments once and in order, for datagrams at each arrival.
  std::function<void(std::vector<std::uint8_t>)> on_segment;
  std::function<void(std::span<const std::uint8_t>)> on_datagram;
  // This is called when may_send() is true again.
  std::function<void()> on_room;

 private:
  enum class Kind : std::uint8_t { segment, datagram, probe };
  struct Packet {
    Kind kind = Kind::probe;
    std::uint64_t segment = 0;
    std::vector<std::uint8_t> bytes;
    std::int64_t sent_ns = 0;
    std::size_t wire_bytes = 0;
    bool is_acknowledged = false, is_lost = false;
  };
  void transmit(Kind kind, std::uint64_t segment, std::vector<std::uint8_t> bytes);
  void arrive(std::uint64_t number, Kind kind, std::uint64_t segment, const std::vector<std::uint8_t>& bytes);
  void acknowledge();
  // The receiver has held the acknowledgement of its newest arrival back for `held_ns`.
  void on_acknowledgement(std::uint64_t count, std::int64_t held_ns);
  void measure(std::int64_t round_trip_ns);
  void find_losses();
  void lose(Packet& packet);
  void go_on();
  void set_timer();
  void on_timeout();
  [[nodiscard]] std::int64_t timeout_ns() const;
  [[nodiscard]] std::int64_t loss_wait_ns() const;

  Timeline* timeline_;
  Recovery recovery_;
  Path forth_, back_;
  // The packets with numbers from first_ on.
  std::deque<Packet> packets_;
  // Packets with lower numbers have arrived, or are lost.
  std::uint64_t first_ = 0;
  // The number of the newest acknowledged packet, plus 1.
  std::uint64_t acknowledged_below_ = 0;
  // The numbers in the order of arrival, without those that the sender knows.
  std::deque<std::uint64_t> arrivals_;
  // The number of arrivals that were taken out of `arrivals_`, because the sender knows them.
  std::uint64_t arrivals_before_ = 0;
  // The number of arrivals that are not acknowledged yet.
  int unanswered_ = 0;
  // The number of acknowledgements, so that a planned one is left out if another one was sent meanwhile.
  std::uint64_t answer_ = 0;
  // The time of the newest arrival.
  std::int64_t arrived_ns_ = 0;
  // The numbers of segments that were sent, and of those that were delivered.
  std::uint64_t segment_count_ = 0, next_segment_ = 0;
  // The bytes of the segments that are not acknowledged.
  std::map<std::uint64_t, std::size_t> kept_;
  // The segments that arrived before earlier ones.
  std::map<std::uint64_t, std::vector<std::uint8_t>> early_;
  // The segments to send again.
  std::map<std::uint64_t, std::vector<std::uint8_t>> lost_;
  // The bytes of packets that are neither acknowledged nor lost, and the sum of `kept_`.
  std::size_t in_flight_ = 0, kept_bytes_ = 0;
  // The congestion window in bytes, at first that of ten packets (RFC 6928, RFC 9002), and the slow-start threshold, at
  // first without a limit.
  double window_ = 10 * kPacketBytes, threshold_ = 1e12;
  // The time of the last reduction of the window. Losses of packets that were sent before it do not reduce the
  // window again.
  std::int64_t recovery_since_ns_ = -1;
  // The window has held something back since the last acknowledgement.
  bool is_limited_ = false;
  // The smoothed round trip and its smoothed deviation; 0 means that none was measured yet.
  double round_trip_ns_ = 0, deviation_ns_ = 0;
  // The number of time-outs in a row.
  int timeouts_ = 0;
  // The number of timers that were set, so that only the newest one acts.
  std::uint64_t timer_ = 0;
  // The time-out counts from this time: the last sending or acknowledgement.
  std::int64_t timer_from_ns_ = 0;
};

}  // namespace hairnet::whole
