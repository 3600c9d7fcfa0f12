#pragma once

#include <cstdint>
#include <deque>
#include <memory>
#include <optional>
#include <variant>
#include <vector>

#include "schema/wire/messages.hpp"
#include "server/exchange/groom_service.hpp"
#include "server/session/connection.hpp"
#include "server/session/session_counters.hpp"
#include "server/session/session_limits.hpp"
#include "server/threading/token_bucket.hpp"

namespace hairnet::server {

// The grooms that one session has requested, sent in pieces: one groom after the other, or, where downloads have
// streams of their own (WebTransport), several at a time, in turn. Frames share the connection: a piece goes when
// nothing else waits, or when all else has had three times as many bytes (BulkScheduler), and a token bucket bounds the
// bytes of a second. I/O thread.
class Downloads {
 public:
  // Without streams, frames wait for at most one piece, so a larger piece would delay them on a slow line. A smaller
  // one has more envelopes.
  static constexpr std::size_t kPiece_bytes = 16 << 10;
  // The number of streams that are open at a time. The same number bounds the files that are read from disk for one
  // session.
  static constexpr std::size_t kStreamsMax = 4;

  // One packet of a download that has a stream; `is_last` ends the stream.
  struct Piece {
    DownloadStream stream = 0;
    wire::GroomData data;
    bool is_last = false;
  };

  Downloads(GroomService& groom_service, const SessionLimits& limits, SessionCounters& counters, std::int64_t now_ns)
      : groom_service_(&groom_service),
        limits_(&limits),
        counters_(&counters),
        bytes_(limits.download_bytes_per_s, limits.download_bytes_per_s, now_ns) {}

  // Puts a groom in line. One that waits already is not put in line again. Refuses a groom that is neither in memory
  // nor in the cache, an offset beyond its end, and more than downloads_per_session_max requests. If the file vanishes
  // from the cache before its turn, the client gets an Error instead of it.
  Refused add(const wire::GroomRequest& request);
  // The next piece, or an error instead of a groom; none while nothing waits, while the first groom is read from disk,
  // or while the session has had its share of bytes.
  std::optional<wire::Message> next(SessionId session, std::int64_t now_ns);
  // Returns the next piece for a stream that has room, of one download after the other; opens streams. Errors belong to
  // no stream.
  std::optional<std::variant<Piece, wire::Error>> next_on_stream(Connection& connection, SessionId session,
                                                                 std::int64_t now_ns);
  // Takes the file that GroomService::fetch has read from disk; null: it is gone or damaged. Returns whether this
  // session waited for it.
  bool on_read(const wire::GroomHash& groom, std::shared_ptr<const std::vector<std::uint8_t>> bytes);
  // The peer does not want the rest. A stopped download does not begin again unless the peer requests it.
  void on_stopped(DownloadStream stream);
  // Ends a download whose stream has had no room for too long; none: there is no such download.
  std::optional<wire::Error> give_up_stalled(Connection& connection, std::int64_t now_ns);
  // The connection is lost or the session leaves. The client requests what it still wants after a resume.
  void clear() { waiting_.clear(); }
  [[nodiscard]] bool is_waiting() const { return !waiting_.empty(); }

 private:
  struct Download {
    wire::GroomHash hash{};
    std::uint64_t offset = 0;
    // Shared until all of it is sent, even if the groom is evicted. Null: not yet read from disk. A session reads few
    // files at a time, so that many requests do not fill the memory.
    std::shared_ptr<const std::vector<std::uint8_t>> bytes;
    bool is_fetching = false, is_gone = false;
    std::optional<DownloadStream> stream = {};
    // The last piece was sent on the stream at this time, or the stream was opened.
    std::int64_t moved_ns = 0;
  };

  void check_invariants() const;
  // Reads the file from disk if it is not in memory. False: it is being read.
  bool has_answer(Download& download, SessionId session);
  // Returns the error that the client gets instead of a download that cannot be sent; none: it can. Asserts
  // has_answer().
  std::optional<wire::Error> refusal_of(const Download& download);
  // Returns the next piece of the download; none while the session has had its share of bytes. Asserts that
  // refusal_of() is none.
  std::optional<wire::GroomData> take_piece(Download& download, std::int64_t now_ns);
  [[nodiscard]] static bool is_done(const Download& download) { return download.offset == download.bytes->size(); }

  GroomService* groom_service_;
  const SessionLimits* limits_;
  SessionCounters* counters_;
  TokenBucket bytes_;
  std::deque<Download> waiting_;
  // Selects the download with a stream that is next. It only grows, and next_on_stream() takes the remainder.
  std::size_t turn_ = 0;
};

}  // namespace hairnet::server
