#pragma once

#include <atomic>
#include <compare>
#include <cstddef>
#include <cstdint>
#include <list>
#include <map>
#include <mutex>
#include <unordered_map>
#include <vector>

#include "schema/wire/frame_datagram.hpp"
#include "server/exchange/observer_sink.hpp"
#include "server/session/session_counters.hpp"

namespace hairnet::server {

// The send queue of one session: messages, bounded in bytes, and the frames and hands of a few ticks, in order. A full
// queue drops all of these together: only the newest are worth sending. While the connection is blocked, the
// announcement of a member that leaves before it was sent is removed instead of followed by a MemberLeft: members that
// come and go do not fill the queue of a client that reads slowly. For the same reason only the newest MemberChanged
// and the newest MemberTouch of a member wait. The tick and I/O threads push; the I/O thread takes.
class Outbox final : public ObserverSink {
 public:
  static constexpr std::size_t kTicksWaitingMax = 3;  // while the connection is blocked
  // The bound while the I/O thread has not tried to send. A late server runs several ticks without a pause, which does
  // not mean that the client is slow.
  static constexpr std::size_t kTicksUnseenMax = 8;
  static constexpr double kReadLeast_bytes_per_s = 16'384;  // a client that reads less may be called slow

  // `datagram_bytes_max`: of the connection.
  Outbox(std::size_t control_bytes_max, SessionCounters& counters, std::size_t datagram_bytes_max = 0);

  // Messages with a higher number in union Body are not sent: the client does not know them. Call it before the tick
  // has the sink.
  void set_message_max(std::uint8_t number) { message_max_ = number; }
  // The last layout of datagrams that the client knows. Call it before the tick has the sink.
  void set_datagram_layout(std::uint8_t layout) { datagram_layout_ = layout; }

  // Asserts that the message fits a packet: the server sends none that does not.
  void push(const wire::Message& message, std::int64_t now_ns) override;
  void push_encoded(const wire::Message& message, std::vector<std::uint8_t> packet, std::int64_t now_ns) override;
  [[nodiscard]] std::size_t datagram_bytes_max() const override { return datagram_bytes_max_; }
  [[nodiscard]] bool takes_frame_datagrams() const override { return datagram_layout_ >= wire::kFrameDatagramLayout; }
  [[nodiscard]] bool takes_room_hands() const override {
    return wire::Message(wire::RoomHands{}).index() < message_max_;
  }
  [[nodiscard]] double bytes_per_s() const override { return bytes_per_s_.load(std::memory_order_relaxed); }
  void push_frames(std::vector<FramePacket> packets) override;
  void withdraw_frames();  // those that wait are not sent, and the observer hears that they are lost
  bool drop_if_congested() override;
  // Queues the goodbye as the last packet: drops the frames that wait, and everything pushed later.
  void push_goodbye(const wire::Goodbye& goodbye, std::int64_t now_ns);

  // The next packet, its clock set to `now_ns`. False when nothing waits. `may_be_lost`: see FramePacket.
  bool take(std::vector<std::uint8_t>& packet, bool& may_be_lost, std::int64_t now_ns);
  // The next packet that may be lost, if one waits: it need not wait for others.
  bool take_losable(std::vector<std::uint8_t>& packet, std::int64_t now_ns);
  void set_bytes_per_s(double bytes_per_s) { bytes_per_s_.store(bytes_per_s, std::memory_order_relaxed); }
  // Call it when the connection is not writable. The next take() resets it.
  void mark_blocked();

  // A message did not fit: the client misses it, so the session must end.
  [[nodiscard]] bool overflowed() const;
  // The first message has waited longer than `wait_ns`, plus the time that the messages before it took at
  // kReadLeast_bytes_per_s.
  [[nodiscard]] bool is_overdue(std::int64_t now_ns, std::int64_t wait_ns) const;
  [[nodiscard]] std::size_t packet_count() const;
  [[nodiscard]] std::size_t control_bytes_waiting() const;
  // Counts messages and frames.
  [[nodiscard]] std::size_t bytes_waiting() const;
  [[nodiscard]] std::size_t ticks_waiting() const;

 private:
  // A message of a kind of which the newest of a member replaces the one before; member 0: it is of no such kind.
  struct Replaceable {
    std::size_t kind = 0;  // in wire::Message
    std::uint32_t member = 0;
    friend auto operator<=>(const Replaceable&, const Replaceable&) = default;
  };
  static Replaceable replaceable_of(const wire::Message& message);
  struct Waiting {
    std::vector<std::uint8_t> packet;
    // Counts pushes of frames; zero: it is a message.
    std::uint64_t tick = 0;
    std::size_t frame_count = 0;
    bool may_be_lost = false;
    // The messages before this one are sent by then, at kReadLeast_bytes_per_s.
    std::int64_t expected_ns = 0;
    // A MemberJoined names its member; zero: it is none.
    std::uint32_t joined_member = 0;
    Replaceable replaceable = {};
    // Is last_tick_ when the MemberJoined was pushed.
    std::uint64_t joined_in_tick = 0;
  };
  using Queue = std::list<Waiting>;  // messages leave from its middle
  // The mutex is held.
  // Removes the MemberJoined of that member if it waits and the connection is blocked.
  bool cancel_joined(std::uint32_t member);
  // Removes the message that it replaces, if one waits.
  void cancel_replaced(const Replaceable& newer);
  void erase_message(Queue::iterator message);
  // Takes it out of the queue, to be sent.
  std::vector<std::uint8_t> take_out(Queue::iterator taken);
  void drop_frames();
  void check_invariants() const;

  const std::size_t control_bytes_max_, datagram_bytes_max_;
  std::uint8_t datagram_layout_ = 0;
  std::size_t message_max_ = std::variant_size_v<wire::Message>;
  SessionCounters* counters_;
  std::atomic<double> bytes_per_s_{0};
  mutable std::mutex mutex_;
  Queue waiting_;
  std::unordered_map<std::uint32_t, Queue::iterator> joined_;  // by member: the last MemberJoined that waits
  std::map<Replaceable, Queue::iterator> replaceable_;         // those that wait
  std::size_t control_bytes_ = 0;
  std::uint64_t last_tick_ = 0;
  std::size_t ticks_waiting_ = 0;
  bool overflowed_ = false, closed_ = false, is_blocked_ = false;
  bool frames_lost_ = false;  // since the last drop_if_congested()
};

}  // namespace hairnet::server
