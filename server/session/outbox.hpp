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
// announcement of a member that leaves before it was sent is removed instead of followed by a MemberLeft: so members
// that come and go add nothing, and the size of the room bounds the queue of a client that reads slowly. For the same
// reason only the newest MemberChanged and the newest MemberTouch of a member wait. The tick and I/O threads push; the
// I/O thread takes.
class Outbox final : public ObserverSink {
 public:
  // While the connection is blocked, frames of at most this many ticks wait (0.1 s at 30 Hz). More would only be old
  // when they are sent.
  static constexpr std::size_t kTicksWaitingMax = 3;
  // While the I/O thread has not found the connection blocked, frames of this many ticks may wait. A late server runs
  // several ticks without a pause, which does not mean that the client is slow.
  static constexpr std::size_t kTicksUnseenMax = 8;
  // A client that reads fewer bytes than this in a second counts as slow. A message is overdue only when the client
  // could have read the bytes before it at this rate (see is_overdue).
  static constexpr double kReadLeast_bytes_per_s = 16'384;

  // `control_bytes_max` bounds the bytes of the messages that wait; `counters` must outlive the outbox;
  // `datagram_bytes_max` is the largest datagram of the connection, 0 without datagrams.
  Outbox(std::size_t control_bytes_max, SessionCounters& counters, std::size_t datagram_bytes_max = 0);

  // `number` is Hello.message_max: the highest number in union Body that the client knows. Messages with a higher
  // number are not sent. Call it before the tick has the sink.
  void set_message_max(std::uint8_t number) { message_max_ = number; }
  // `layout` is Hello.datagram_layout: the newest layout of frame datagrams that the client knows. Call it before the
  // tick has the sink.
  void set_datagram_layout(std::uint8_t layout) { datagram_layout_ = layout; }

  // These functions implement ObserverSink; its header has what each promises. push() asserts that the message fits a
  // packet.
  void push(const wire::Message& message, std::int64_t now_ns) override;
  void push_encoded(const wire::Message& message, std::vector<std::uint8_t> packet, std::int64_t now_ns) override;
  [[nodiscard]] std::size_t datagram_bytes_max() const override { return datagram_bytes_max_; }
  [[nodiscard]] bool takes_frame_datagrams() const override { return datagram_layout_ >= wire::kFrameDatagramLayout; }
  [[nodiscard]] bool takes_room_hands() const override {
    return wire::Message(wire::RoomHands{}).index() < message_max_;
  }
  [[nodiscard]] double bytes_per_s() const override { return bytes_per_s_.load(std::memory_order_relaxed); }
  void push_frames(std::vector<FramePacket> packets) override;
  // Drops the frames that wait. The next drop_if_congested() then returns true, so that the tick knows of the loss. A
  // server that may not own the room any more calls this, since it must not send its frames.
  void withdraw_frames();
  bool drop_if_congested() override;
  // Queues the goodbye as the last packet: drops the frames that wait, and everything pushed later.
  void push_goodbye(const wire::Goodbye& goodbye, std::int64_t now_ns);

  // Moves the next packet into `packet`, and sets the clock of its envelope to `now_ns`. Returns false when nothing
  // waits. `may_be_lost` is that of FramePacket.
  bool take(std::vector<std::uint8_t>& packet, bool& may_be_lost, std::int64_t now_ns);
  // Takes the next packet that may be lost, if one waits. It may overtake the packets before it, so it also leaves
  // while the ordered stream is blocked.
  bool take_unreliable(std::vector<std::uint8_t>& packet, std::int64_t now_ns);
  // The I/O thread stores the latest estimate of the connection's rate here, for bytes_per_s().
  void set_bytes_per_s(double bytes_per_s) { bytes_per_s_.store(bytes_per_s, std::memory_order_relaxed); }
  // Call it when the connection is not writable. take() ends this state, because it is called only for a writable
  // connection.
  void mark_blocked();

  // True after a message did not fit into control_bytes_max. The client misses this message, so the session must end.
  // The tick only sets the flag, because sessions belong to the I/O thread: Session::poll reads it.
  [[nodiscard]] bool overflowed() const;
  // The first message has waited longer than `wait_ns`, plus the time that the messages before it took at
  // kReadLeast_bytes_per_s. Such a client is slow, even if it reads a little now and then.
  [[nodiscard]] bool is_overdue(std::int64_t now_ns, std::int64_t wait_ns) const;
  // The packets that wait: messages and packets of frames.
  [[nodiscard]] std::size_t packet_count() const;
  // The bytes of the messages that wait, without frames and without the goodbye.
  [[nodiscard]] std::size_t control_bytes_waiting() const;
  // The bytes of all that waits, frames included. The function walks the whole queue, so it is for rare use
  // (SessionRegistry::free_memory).
  [[nodiscard]] std::size_t bytes_waiting() const;
  // The ticks of which at least one packet waits.
  [[nodiscard]] std::size_t ticks_waiting() const;

 private:
  // Identifies the MemberChanged or the MemberTouch of a member, of which only the newest waits. Member 0: the message
  // is of another kind.
  struct Replaceable {
    // The index of the message in wire::Message.
    std::size_t kind = 0;
    std::uint32_t member = 0;
    friend auto operator<=>(const Replaceable&, const Replaceable&) = default;
  };
  static Replaceable replaceable_of(const wire::Message& message);
  // A packet in the queue.
  struct Waiting {
    std::vector<std::uint8_t> packet;
    // The number of the push_frames() call that the packet belongs to, counted from 1. Zero: the packet is a message.
    std::uint64_t tick = 0;
    std::size_t frame_count = 0;
    bool may_be_lost = false;
    // The time by which a client that reads kReadLeast_bytes_per_s has read the messages before this one.
    std::int64_t expected_ns = 0;
    // The member of a MemberJoined; zero: the packet is none.
    std::uint32_t joined_member = 0;
    Replaceable replaceable = {};
    // The value of last_tick_ when the MemberJoined was pushed: frames of later ticks may be the member's.
    std::uint64_t joined_in_tick = 0;
  };
  // A list, because messages leave from its middle and the maps below keep iterators into it.
  using Queue = std::list<Waiting>;
  // Removes the MemberJoined of the member if it waits and the connection is blocked, and returns whether it did. The
  // caller of this function and of those below holds the mutex.
  bool cancel_joined(std::uint32_t member);
  // Removes the waiting message that `newer` replaces, if there is one.
  void cancel_replaced(const Replaceable& newer);
  // Removes a message that will never be sent, and counts it as cancelled.
  void erase_message(Queue::iterator message);
  // Removes the packet from the queue, counts it as sent, and returns its bytes.
  std::vector<std::uint8_t> take_out(Queue::iterator taken);
  // Removes all packets of frames, and counts their frames as superseded.
  void drop_frames();
  void check_invariants() const;

  const std::size_t control_bytes_max_, datagram_bytes_max_;
  // What the client can read, from its Hello. The default lets every message pass.
  std::uint8_t datagram_layout_ = 0;
  std::size_t message_max_ = std::variant_size_v<wire::Message>;
  SessionCounters* counters_;
  // The connection's rate as its congestion control estimates it; 0: unknown. The I/O thread writes it, the tick reads
  // it.
  std::atomic<double> bytes_per_s_{0};
  // Guards all members below.
  mutable std::mutex mutex_;
  Queue waiting_;
  // By member: its last MemberJoined that waits.
  std::unordered_map<std::uint32_t, Queue::iterator> joined_;
  // By kind and member: the message that waits and may be replaced.
  std::map<Replaceable, Queue::iterator> replaceable_;
  // The bytes of messages that wait, without frames: a bound in ticks limits those.
  std::size_t control_bytes_ = 0;
  // The number of calls of push_frames() so far, and the number of those of which a packet still waits.
  std::uint64_t last_tick_ = 0;
  std::size_t ticks_waiting_ = 0;
  // overflowed_: see overflowed(). closed_: the goodbye is queued, and nothing may follow it. is_blocked_:
  // mark_blocked() was called, and no take() since.
  bool overflowed_ = false, closed_ = false, is_blocked_ = false;
  // Frames were dropped outside of drop_if_congested(), which reports that at its next call.
  bool frames_lost_ = false;
};

}  // namespace hairnet::server
