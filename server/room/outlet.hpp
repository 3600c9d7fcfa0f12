#pragma once

#include <cstdint>
#include <vector>

#include "schema/wire/messages.hpp"

namespace hairnet::server {

// Where the tick leaves what one session is to get: the session's outbox. Any thread may call it; none blocks.
class Outlet {
 public:
  virtual ~Outlet() = default;
  // Kept in order and never dropped; sent before any frame that is still waiting.
  virtual void push(const wire::Message& message, std::int64_t now_ns) = 0;
  // A newer frame of a character takes the place of one not yet sent.
  virtual void push_frames(std::uint64_t tick, std::int64_t sample_time_ns, std::vector<wire::Frame> frames) = 0;
};

}  // namespace hairnet::server
