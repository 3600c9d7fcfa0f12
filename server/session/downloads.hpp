#pragma once

#include <cstdint>
#include <deque>
#include <memory>
#include <optional>
#include <vector>

#include "schema/wire/messages.hpp"
#include "server/exchange/groom_service.hpp"
#include "server/session/session_counters.hpp"
#include "server/session/session_limits.hpp"
#include "server/threading/token_bucket.hpp"

namespace hairnet::server {

// The grooms that one session has requested, sent in pieces, one groom after the other. I/O thread.
class Downloads {
 public:
  static constexpr std::size_t kPiece_bytes = 16 << 10;  // frames wait for at most one piece

  Downloads(GroomService& groom_service, const SessionLimits& limits, SessionCounters& counters, std::int64_t now_ns)
      : groom_service_(&groom_service),
        limits_(&limits),
        counters_(&counters),
        bytes_(limits.download_bytes_per_s, limits.download_bytes_per_s, now_ns) {}

  // A groom that is requested again while it waits is sent once.
  Refused add(const wire::GroomRequest& request);
  // The next piece, or an error instead of a groom; none while nothing waits, while the first groom is read from disk,
  // or while the session has had its share of bytes.
  std::optional<wire::Message> next(SessionId session, std::int64_t now_ns);
  // Takes the result of GroomService::fetch; null when the file is gone or damaged. True when this session waited for
  // it.
  bool on_read(const wire::GroomHash& groom, std::shared_ptr<const std::vector<std::uint8_t>> bytes);
  void clear() { waiting_.clear(); }
  [[nodiscard]] bool is_waiting() const { return !waiting_.empty(); }

 private:
  void check_invariants() const;

  struct Download {
    wire::GroomHash hash{};
    std::uint64_t offset = 0;
    // Shared until all of it is sent, even if the groom is evicted. Null: not yet read from disk. A session reads one
    // file at a time, so that many requests do not fill the memory.
    std::shared_ptr<const std::vector<std::uint8_t>> bytes;
    bool is_fetching = false, is_gone = false;
  };

  GroomService* groom_service_;
  const SessionLimits* limits_;
  SessionCounters* counters_;
  TokenBucket bytes_;
  std::deque<Download> waiting_;
};

}  // namespace hairnet::server
