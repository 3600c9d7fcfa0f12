#pragma once

#include <cstdint>
#include <vector>

#include "schema/wire/messages.hpp"

namespace hairnet::server {

// One packet of a tick's frames.
struct FramePacket {
  std::vector<std::uint8_t> bytes;
  std::size_t frame_count = 0;
};

// Where the tick leaves what one session is to get: the session's outbox. Any thread may call it; none blocks.
class Outlet {
 public:
  virtual ~Outlet() = default;
  // Kept in order, and dropped only when the session ends: a message that does not fit ends it.
  virtual void push(const wire::Message& message, std::int64_t now_ns) = 0;
  // One tick's frames as packets, in order with messages. The session takes them one by one.
  virtual void push_frames(std::vector<FramePacket> packets) = 0;
  // Before frames are made. True when too many ticks' frames wait: they are dropped, and nothing sent before may be
  // referred to.
  virtual bool make_way() = 0;
};

}  // namespace hairnet::server
