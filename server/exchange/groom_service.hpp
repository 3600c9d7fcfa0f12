#pragma once

#include <cstdint>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "schema/wire/messages.hpp"
#include "server/exchange/character_key.hpp"

namespace hairnet::server {

// The reason of a refusal; `reason` none means that nothing was refused.
struct Refused {
  wire::ErrorReason reason = wire::ErrorReason::none;
  std::string detail;
  explicit operator bool() const { return reason != wire::ErrorReason::none; }
};

// The result of a chunk. A chunk may be neither wanted nor refused: after a resume the server may request the same
// bytes twice, and it ignores the second copy.
struct ChunkAnswer : Refused {
  bool was_wanted = false;
};

// With which other sessions a session shares limits.
struct GroomShare {
  // Sessions with this number have one share of places, bytes and builds. 0: the session has a share of its own.
  std::uint32_t subject = 0;
  // Sessions with this number have at most strand_count_max strands together. A groom that several of them use counts
  // once.
  std::uint32_t token_holder = 0;
  std::uint64_t strand_count_max = std::numeric_limits<std::uint64_t>::max();
};

// What sessions can do with grooms: offer, upload, use and download them. I/O thread. Answers (GroomNeed, GroomStatus,
// late errors) are sent to the session as messages, in order.
class GroomService {
 public:
  virtual ~GroomService() = default;
  // A session begins, or its token changes. Without this call it shares with none.
  virtual void open(SessionId session, const GroomShare& share, std::int64_t now_ns) = 0;
  // The session has the groom's file and wants to use it. GroomNeed follows, at once or later: it says whether the
  // bytes are asked for.
  virtual Refused offer(SessionId session, const wire::GroomOffer& offer, std::int64_t now_ns) = 0;
  // A piece of the file. The pieces of one upload come in order, without gaps.
  virtual ChunkAnswer chunk(SessionId session, wire::GroomChunk chunk, std::int64_t now_ns) = 0;
  // The session uses the groom from now on, so the groom is not evicted. Refuses groom_unknown when no session has
  // offered the groom and the cache does not have it.
  virtual Refused retain(SessionId session, const wire::GroomHash& groom, std::int64_t now_ns) = 0;
  // Sends the state of each groom that the session uses again.
  virtual void resend_states(SessionId session, std::int64_t now_ns) = 0;
  // The validated file of a groom in memory; null when it is not in memory. The pointer stays valid after the groom is
  // evicted.
  virtual std::shared_ptr<const std::vector<std::uint8_t>> bytes(const wire::GroomHash& groom) = 0;
  // Starts to read a groom's file from the cache; Session::on_groom_read follows. False when the cache does not have
  // it.
  virtual bool fetch(SessionId session, const wire::GroomHash& groom) = 0;
  // Whether the cache has the groom's file, so that fetch() would return true.
  [[nodiscard]] virtual bool is_cached(const wire::GroomHash& groom) const = 0;
  // The grooms that sessions use and that are ready, those of most sessions first.
  [[nodiscard]] virtual std::vector<wire::GroomHash> in_use() const = 0;
  // The session has ended: its unfinished uploads stop, and it uses no groom any more.
  virtual void release(SessionId session, std::int64_t now_ns) = 0;
};

}  // namespace hairnet::server
