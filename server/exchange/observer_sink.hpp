#pragma once

#include <cstdint>
#include <vector>

#include "schema/wire/messages.hpp"

namespace hairnet::server {

// One packet, or frame datagram, of a tick's frames, or of hands.
struct FramePacket {
  std::vector<std::uint8_t> bytes;
  // The packet carries this many characters' frames; 0: it carries hands.
  std::size_t frame_count = 0;
  // Newer frames replace the content, so the packet may travel where packets get lost or overtake each other.
  bool may_be_lost = false;
};

// Receives the messages and frames that the tick makes for one session; implemented by the session's Outbox. Any
// thread; calls never block.
class ObserverSink {
 public:
  virtual ~ObserverSink() = default;
  // Queues a message. Order is kept, and no message is dropped: one that does not fit ends the session.
  virtual void push(const wire::Message& message, std::int64_t now_ns) = 0;
  // Queues a message whose encoded bytes are `packet`. A message that many sessions get is encoded once, and copied
  // here.
  virtual void push_encoded(const wire::Message& message, std::vector<std::uint8_t> packet, std::int64_t now_ns) = 0;
  // The largest packet that may be lost; 0: none, everything arrives in order.
  [[nodiscard]] virtual std::size_t datagram_bytes_max() const { return 0; }
  // Whether packets that may be lost can be frame datagrams, which have no envelope.
  [[nodiscard]] virtual bool takes_frame_datagrams() const { return false; }
  // Whether its client knows the message RoomHands, which goes with the frames.
  [[nodiscard]] virtual bool takes_room_hands() const { return false; }
  // The rate that the session's connection carries, by the last estimate of its congestion control; 0: unknown.
  [[nodiscard]] virtual double bytes_per_s() const { return 0; }
  // Queues the frames and hands of one tick, after the messages pushed so far.
  virtual void push_frames(std::vector<FramePacket> packets) = 0;
  // Call it before making frames. When the frames of too many ticks wait, drops them all and returns true. The dropped
  // frames leave a gap: the caller must forget what it has sent, since the receiver has not got it.
  virtual bool drop_if_congested() = 0;
};

}  // namespace hairnet::server
