#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "schema/wire/messages.hpp"
#include "server/room/character_key.hpp"

namespace hairnet::server {

// Why something was refused; `reason` none means it was not.
struct Refused {
  wire::ErrorReason reason = wire::ErrorReason::none;
  std::string detail;
  explicit operator bool() const { return reason != wire::ErrorReason::none; }
};

// What became of a chunk. Not wanted, and no fault either: one that is there already, as after a resume, when a client may be
// asked twice for the same bytes.
struct ChunkAnswer : Refused {
  bool was_wanted = false;
};

// Where sessions hand in grooms, and fetch others'. I/O thread. What a session is to hear (GroomNeed, GroomStatus, late
// errors) comes back through its own message path, in order.
class GroomDesk {
 public:
  virtual ~GroomDesk() = default;
  // A session begins: what it may have. Without this it has the server's own limits.
  virtual void open(SessionId session, std::uint64_t strand_count_max, std::int64_t now_ns) = 0;
  virtual Refused offer(SessionId session, const wire::GroomOffer& offer, std::int64_t now_ns) = 0;
  virtual ChunkAnswer chunk(SessionId session, wire::GroomChunk chunk, std::int64_t now_ns) = 0;
  // From now on the session uses the groom, so it stays. groom_unknown unless someone has offered it, or it is kept on
  // disk.
  virtual Refused hold(SessionId session, const wire::GroomHash& groom) = 0;
  // Says again how the grooms are that the session holds.
  virtual void tell_states(SessionId session, std::int64_t now_ns) = 0;
  // The file of a groom in memory, sound and within limits; null when it is not there. Whoever has it keeps it, even
  // when the groom has to go meanwhile.
  virtual std::shared_ptr<const std::vector<std::uint8_t>> bytes(const wire::GroomHash& groom) = 0;
  // Reads a groom's file from disk: Session::on_groom_read follows. False when it is not kept there.
  virtual bool fetch(SessionId session, const wire::GroomHash& groom) = 0;
  // Whether fetch would.
  [[nodiscard]] virtual bool keeps(const wire::GroomHash& groom) const = 0;
  // The session has ended: its unfinished uploads and holds go.
  virtual void release(SessionId session, std::int64_t now_ns) = 0;
};

}  // namespace hairnet::server
