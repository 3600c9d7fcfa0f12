#include "tests/whole/packet_sender.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

namespace hairnet::whole {
namespace {

// An acknowledgement is hardly more than its headers (kOverheadBytes).
constexpr std::size_t kAcknowledgementBytes = 60;
// A packet counts as lost when so many newer packets have arrived (RFC 9002, 6.1.1; three duplicates in TCP).
constexpr std::uint64_t kReorderedPackets = 3;
// A packet also counts as lost after so many round trips, once a newer one has arrived (RFC 9002, 6.1.2).
constexpr double kReorderedTrips = 9.0 / 8;
// A loss multiplies the window by this factor: that of CUBIC (RFC 9438).
constexpr double kShrink = 0.7;
// The largest window that nobody needs, bytes.
constexpr double kUnusedMax = 64e3;
// The time-out before a round trip was measured is 333 ms, QUIC's assumed round trip (RFC 9002, 6.2.2). Each further
// time-out in a row is twice as long, up to 64 times.
constexpr std::int64_t kFirstTimeout_ns = kSecond_ns / 3;
constexpr int kTimeoutDoublingsMax = 6;

}  // namespace

// One packet may always be on the way, however small the window is.
bool PacketSender::may_send() const {
  return static_cast<double>(in_flight_) < std::max(window_, double{kPacketBytes});
}

double PacketSender::bytes_per_s() const {
  return round_trip_ns_ == 0 ? 0 : 1e9 * window_ / round_trip_ns_;
}

void PacketSender::send_segment(std::vector<std::uint8_t> bytes) {
  kept_[segment_count_] = bytes.size();
  kept_bytes_ += bytes.size();
  transmit(Kind::segment, segment_count_++, std::move(bytes));
}

void PacketSender::send_datagram(std::vector<std::uint8_t> bytes) {
  transmit(Kind::datagram, 0, std::move(bytes));
}

// Sends a packet with a number of its own, also where its segment is sent again. `is_limited_` notes that the window
// was full.
void PacketSender::transmit(Kind kind, std::uint64_t segment, std::vector<std::uint8_t> bytes) {
  const std::uint64_t number = first_ + packets_.size();
  const std::size_t wire_bytes = bytes.size() + kOverheadBytes;
  packets_.push_back({.kind = kind,
                      .segment = segment,
                      .bytes = std::move(bytes),
                      .sent_ns = timeline_->now_ns(),
                      .wire_bytes = wire_bytes});
  in_flight_ += wire_bytes;
  is_limited_ = is_limited_ || !may_send();
  forth_.send(wire_bytes, [weak = weak_from_this(), number, kind, segment, bytes = packets_.back().bytes] {
    if (const auto self = weak.lock()) self->arrive(number, kind, segment, bytes);
  });
  timer_from_ns_ = timeline_->now_ns();
  set_timer();
}

// Runs at the receiver. Segments are delivered once and in order; a datagram is delivered as often as the path delivers
// it.
void PacketSender::arrive(std::uint64_t number, Kind kind, std::uint64_t segment,
                          const std::vector<std::uint8_t>& bytes) {
  const auto self = shared_from_this();
  arrivals_.push_back(number);
  arrived_ns_ = timeline_->now_ns();
  const bool may_wait = recovery_.answers_late && kind == Kind::datagram;
  if (++unanswered_ >= quic::AnswerDelay::kDatagramsMax || !may_wait) {
    acknowledge();
  } else if (unanswered_ == 1) {
    timeline_->after(quic::AnswerDelay::of_client(std::llround(round_trip_ns_)),
                     [weak = weak_from_this(), answer = answer_] {
                       const auto receiver = weak.lock();
                       if (receiver && answer == receiver->answer_) receiver->acknowledge();
                     });
  }
  if (kind == Kind::datagram && on_datagram) on_datagram(bytes);
  if (kind != Kind::segment || segment < next_segment_) return;
  early_.try_emplace(segment, bytes);
  while (!early_.empty() && early_.begin()->first == next_segment_) {
    std::vector<std::uint8_t> next = std::move(early_.begin()->second);
    early_.erase(early_.begin());
    ++next_segment_;
    if (on_segment) on_segment(std::move(next));
  }
}

void PacketSender::acknowledge() {
  unanswered_ = 0;
  ++answer_;
  back_.send(kAcknowledgementBytes, [weak = weak_from_this(), count = arrivals_before_ + arrivals_.size(),
                                     held_ns = timeline_->now_ns() - arrived_ns_] {
    if (const auto sender = weak.lock()) sender->on_acknowledgement(count, held_ns);
  });
}

// Acknowledges the first `count` arrivals. Each acknowledgement repeats all earlier ones, so that the loss of one does
// no harm.
void PacketSender::on_acknowledgement(std::uint64_t count, std::int64_t held_ns) {
  const auto self = shared_from_this();
  const std::int64_t now_ns = timeline_->now_ns();
  bool is_new = false;
  std::optional<std::int64_t> newest_sent_ns;
  for (; arrivals_before_ < count; ++arrivals_before_) {
    const std::uint64_t number = arrivals_.front();
    arrivals_.pop_front();
    if (number < first_) continue;
    Packet& packet = packets_[number - first_];
    if (std::exchange(packet.is_acknowledged, true)) continue;
    is_new = true;
    if (number >= acknowledged_below_) {
      acknowledged_below_ = number + 1;
      newest_sent_ns = packet.sent_ns;
    }
    if (packet.kind == Kind::segment) {
      if (const auto kept = kept_.find(packet.segment); kept != kept_.end()) {
        kept_bytes_ -= kept->second;
        kept_.erase(kept);
      }
      lost_.erase(packet.segment);
    }
    if (packet.is_lost) continue;
    in_flight_ -= packet.wire_bytes;
    const auto bytes = static_cast<double>(packet.wire_bytes);
    const bool grows = is_limited_ || (recovery_.grows_unused && window_ < kUnusedMax);
    if (grows && packet.sent_ns > recovery_since_ns_)
      window_ += window_ < threshold_ ? bytes : recovery_.growth * kPacketBytes * bytes / window_;
  }
  if (!is_new) return;
  if (newest_sent_ns) measure(now_ns - *newest_sent_ns - held_ns);
  is_limited_ = false;
  timeouts_ = 0;
  timer_from_ns_ = now_ns;
  find_losses();
  go_on();
}

void PacketSender::measure(std::int64_t round_trip_ns) {
  const auto sample = static_cast<double>(round_trip_ns);
  if (round_trip_ns_ == 0) {
    round_trip_ns_ = sample;
    deviation_ns_ = sample / 2;
    return;
  }
  // RFC 6298 and RFC 9002 take a new sample with a weight of 1/4 for the deviation and 1/8 for the round trip.
  deviation_ns_ = 0.75 * deviation_ns_ + 0.25 * std::abs(round_trip_ns_ - sample);
  round_trip_ns_ = 0.875 * round_trip_ns_ + 0.125 * sample;
}

std::int64_t PacketSender::loss_wait_ns() const {
  return static_cast<std::int64_t>(kReorderedTrips * round_trip_ns_);
}

// Looks through the packets below the newest acknowledged one, and forgets those at the front that are settled.
void PacketSender::find_losses() {
  const std::int64_t now_ns = timeline_->now_ns();
  for (std::uint64_t number = first_; number < acknowledged_below_; ++number) {
    Packet& packet = packets_[number - first_];
    if (packet.is_acknowledged || packet.is_lost) continue;
    if (number + kReorderedPackets < acknowledged_below_ || now_ns - packet.sent_ns >= loss_wait_ns()) lose(packet);
  }
  while (!packets_.empty() && (packets_.front().is_acknowledged || packets_.front().is_lost)) {
    packets_.pop_front();
    ++first_;
  }
}

// Only the first loss of a round trip makes the window smaller: packets that were sent before the last reduction do not
// count.
void PacketSender::lose(Packet& packet) {
  packet.is_lost = true;
  in_flight_ -= packet.wire_bytes;
  if (packet.kind == Kind::segment && kept_.contains(packet.segment)) lost_[packet.segment] = packet.bytes;
  if (packet.sent_ns <= recovery_since_ns_) return;
  recovery_since_ns_ = timeline_->now_ns();
  window_ = threshold_ = std::max(kShrink * window_, 2.0 * (kPacketBytes + kOverheadBytes));
}

// Sends again what is lost, then what is new.
void PacketSender::go_on() {
  while (!lost_.empty() && may_send()) {
    const auto first = lost_.begin();
    const std::uint64_t segment = first->first;
    std::vector<std::uint8_t> bytes = std::move(first->second);
    lost_.erase(first);
    transmit(Kind::segment, segment, std::move(bytes));
  }
  set_timer();
  if (may_send() && on_room) on_room();
}

std::int64_t PacketSender::timeout_ns() const {
  if (round_trip_ns_ == 0) return kFirstTimeout_ns << std::min(timeouts_, kTimeoutDoublingsMax);
  if (recovery_.has_tail_probe && timeouts_ == 0) return std::llround(2 * round_trip_ns_);
  const std::int64_t trip_ns = std::llround(round_trip_ns_ + std::max(4 * deviation_ns_, 1e6));
  const std::int64_t once_ns = std::max(trip_ns + recovery_.timeout_more_ns, recovery_.timeout_min_ns);
  return once_ns << std::min(timeouts_ - (recovery_.has_tail_probe ? 1 : 0), kTimeoutDoublingsMax);
}

// Sets the only timer: for the next packet that will count as lost behind newer ones, or else for the time-out of
// everything.
void PacketSender::set_timer() {
  ++timer_;
  std::optional<std::int64_t> late_ns;
  for (std::uint64_t number = first_; number < acknowledged_below_ && !late_ns; ++number) {
    const Packet& packet = packets_[number - first_];
    if (!packet.is_acknowledged && !packet.is_lost) late_ns = packet.sent_ns + loss_wait_ns();
  }
  if (!late_ns && in_flight_ == 0) return;
  timeline_->at(late_ns.value_or(timer_from_ns_ + timeout_ns()),
                [weak = weak_from_this(), timer = timer_, is_late = late_ns.has_value()] {
                  const auto self = weak.lock();
                  if (!self || timer != self->timer_) return;
                  if (is_late) {
                    self->find_losses();
                    self->go_on();
                  } else {
                    self->on_timeout();
                  }
                });
}

void PacketSender::on_timeout() {
  timer_from_ns_ = timeline_->now_ns();
  if (++timeouts_ > 1 && recovery_.timeout_loses_all) {
    for (Packet& packet : packets_) {
      if (!packet.is_acknowledged && !packet.is_lost) lose(packet);
    }
    first_ += packets_.size();
    acknowledged_below_ = first_;
    packets_.clear();
    window_ = kPacketBytes;
    return go_on();
  }
  // A time-out sends the oldest segments once more, as probes. Where there are none, an empty packet asks for an
  // acknowledgement.
  std::map<std::uint64_t, std::vector<std::uint8_t>> oldest;
  for (const Packet& packet : packets_) {
    if (oldest.size() == static_cast<std::size_t>(recovery_.probes)) break;
    if (packet.kind == Kind::segment && kept_.contains(packet.segment))
      oldest.try_emplace(packet.segment, packet.bytes);
  }
  for (auto& [segment, bytes] : oldest) transmit(Kind::segment, segment, std::move(bytes));
  for (std::size_t i = oldest.size(); i < static_cast<std::size_t>(recovery_.probes); ++i) transmit(Kind::probe, 0, {});
}

}  // namespace hairnet::whole
