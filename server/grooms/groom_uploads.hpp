#pragma once

#include <compare>
#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <vector>

#include "schema/bytes/content_hash.hpp"
#include "server/grooms/groom_counters.hpp"
#include "server/grooms/groom_shares.hpp"
#include "server/grooms/groom_store_limits.hpp"
#include "server/threading/token_bucket.hpp"

namespace hairnet::server {

// One session uploads one groom.
struct UploadId {
  wire::GroomHash groom{};
  SessionId session = 0;
  friend auto operator<=>(const UploadId&, const UploadId&) = default;
};

// Receives the uploads of all sessions, from the request for a groom's bytes to its last byte. Each session's bytes
// stay apart and are hashed as they come: with one common buffer, a session could corrupt another's upload with wrong
// bytes. The class also says which upload has to end when places or bytes are short or an upload is too slow; the
// caller ends it. I/O thread.
class GroomUploads {
 public:
  using Chunks = std::vector<std::vector<std::uint8_t>>;
  GroomUploads(const GroomStoreLimits& limits, const GroomShares& shares, GroomCounters& counters)
      : limits_(limits), shares_(&shares), counters_(&counters) {}

  // Charges the announced bytes and opens the upload. Refuses when the session has uploaded too much lately. Asserts
  // that the session does not upload the groom already.
  Refused begin(const UploadId& id, std::uint64_t byte_count, std::int64_t now_ns);
  // Drops what the upload has received. Asserts that the upload exists.
  void end(const UploadId& id);
  // Ends the uploads of the groom by all sessions.
  void end_all(const wire::GroomHash& groom);
  // Forgets a session that has no upload any more.
  void close(SessionId session);
  // The session was away, so no chunk could come: it has not stalled.
  void restart_timeout(SessionId session, std::int64_t now_ns);

  [[nodiscard]] bool has_any(const wire::GroomHash& groom) const;
  // True when a session that shares with this one uploads the groom.
  [[nodiscard]] bool has_any_of_sharer(const UploadId& id) const;
  // Returns the bytes received so far, or nullopt without such an upload.
  [[nodiscard]] std::optional<std::uint64_t> received(const UploadId& id) const;
  // The bytes that all uploads have received.
  [[nodiscard]] std::size_t bytes() const { return bytes_; }

  // Returns the reason why this chunk cannot be the next one of its upload.
  [[nodiscard]] Refused check(SessionId session, const wire::GroomChunk& chunk) const;
  // Takes a chunk that check() lets pass. Returns true when the upload is complete.
  bool put(SessionId session, wire::GroomChunk chunk);
  // Returns the bytes of a complete upload, and ends all uploads of its groom. Returns nullopt, and ends nothing, when
  // they do not have its hash.
  std::optional<Chunks> take(const UploadId& id);

  // Returns the sessions whose uploads have brought too little for too long.
  std::set<SessionId> take_stalled(std::int64_t now_ns);
  [[nodiscard]] std::vector<UploadId> uploads_of(SessionId session) const;
  // What a session lacks: places among the grooms, or upload bytes.
  enum class Scarce : std::uint8_t { places, bytes };
  // Returns an upload that has to end so that the session can have this many more places or bytes: one of the sharer
  // that has most. Returns nullopt when that is the session's own.
  [[nodiscard]] std::optional<UploadId> to_end_for(SessionId session, Scarce what, std::uint64_t more) const;
  // Returns the upload that has received most, or nullopt when none has received anything.
  [[nodiscard]] std::optional<UploadId> largest() const;

  void check_invariants() const;

 private:
  struct Upload {
    // The announced size of the file.
    std::uint64_t byte_count = 0;
    // The bytes that have come so far, in `chunks`; `hasher` has hashed them.
    std::uint64_t received = 0;
    Chunks chunks;
    bytes::ContentHasher hasher;
  };
  using Uploads = std::map<UploadId, Upload>;
  // The sums over a session's uploads. The account outlives the uploads, so that a session cannot refill its bucket by
  // offering grooms again.
  struct Account {
    TokenBucket bytes;
    // The session's uploads have brought `received` bytes since this time, for the minimum rate.
    std::int64_t since_ns = 0;
    std::uint64_t received = 0;
    std::size_t upload_count = 0;
  };
  [[nodiscard]] Uploads::const_iterator first_of(const wire::GroomHash& groom) const {
    return uploads_.lower_bound({groom, 0});
  }

  GroomStoreLimits limits_;
  const GroomShares* shares_;
  GroomCounters* counters_;
  Uploads uploads_;
  std::map<SessionId, Account> accounts_;
  // The sum of Upload::received over all uploads.
  std::size_t bytes_ = 0;
};

}  // namespace hairnet::server
