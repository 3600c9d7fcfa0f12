#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <limits>
#include <map>
#include <memory>
#include <span>
#include <vector>

#include "server/exchange/command.hpp"
#include "server/exchange/groom_service.hpp"
#include "server/grooms/groom_builder.hpp"
#include "server/grooms/groom_counters.hpp"
#include "server/threading/token_bucket.hpp"

namespace hairnet::server {

struct GroomStoreLimits {
  std::size_t groom_bytes_max = std::size_t{64} << 20;    // of one groom
  std::size_t upload_bytes_max = std::size_t{256} << 20;  // of all unfinished and waiting uploads, as announced
  std::size_t level_bytes_max = std::size_t{1} << 30;     // of all levels, and of the files of their grooms
  std::size_t groom_count_max = 1024;
  std::size_t grooms_per_session_max = 64;
  std::size_t strands_per_session_max = 1'000'000;  // of all grooms that a session uses
  double upload_bytes_per_s = 16.0 * (1 << 20);     // of a session, as announced
  double upload_burst_bytes = 256.0 * (1 << 20);
  std::size_t build_queue_max = 16;
  std::int64_t build_ns_max = 600'000'000'000;      // the builder has low priority, so a busy machine needs long
  std::int64_t upload_timeout_ns = 30'000'000'000;  // without a chunk
  GroomLimits groom;
};

// How the store calls back: messages, files and revoked grooms for a session.
struct GroomListener {
  std::function<void(SessionId, const wire::Message&, std::int64_t now_ns)> send;
  // The result of fetch(); null when the file could not be read.
  std::function<void(SessionId, const wire::GroomHash&, std::shared_ptr<const std::vector<std::uint8_t>>,
                     std::int64_t now_ns)>
      deliver;
  // The session may not use the groom any more: remove its characters with this groom.
  std::function<void(SessionId, const wire::GroomHash&, std::int64_t now_ns)> revoke;
};

// All grooms by content hash, from offer to built levels. Sessions that offer the same hash share one upload; when the
// uploader leaves or stalls, another session that has offered the groom continues it. A groom in the cache is not
// uploaded. A groom that no session uses stays until its memory is needed. I/O thread.
class GroomStore final : public GroomService {
 public:
  using Bytes = std::shared_ptr<const std::vector<std::uint8_t>>;
  GroomStore(const GroomStoreLimits& limits, GroomBuilder& builder, CommandQueue& commands, GroomCounters& counters,
             GroomListener listener);

  void open(SessionId session, std::uint32_t bearer, std::uint64_t strand_count_max, std::int64_t now_ns) override;
  Refused offer(SessionId session, const wire::GroomOffer& offer, std::int64_t now_ns) override;
  ChunkAnswer chunk(SessionId session, wire::GroomChunk chunk, std::int64_t now_ns) override;
  Refused retain(SessionId session, const wire::GroomHash& groom) override;
  void resend_states(SessionId session, std::int64_t now_ns) override;
  Bytes bytes(const wire::GroomHash& groom) override;
  bool fetch(SessionId session, const wire::GroomHash& groom) override;
  [[nodiscard]] bool is_cached(const wire::GroomHash& groom) const override { return builder_->is_cached(groom); }
  void release(SessionId session, std::int64_t now_ns) override;
  // An upload has not stalled while its uploader sends chunks of another groom.
  void poll(std::int64_t now_ns);  // results of the builder, stalled uploads

  [[nodiscard]] bool ready(const wire::GroomHash& groom) const;
  [[nodiscard]] std::size_t groom_count() const { return grooms_.size(); }
  [[nodiscard]] std::size_t user_count() const;  // of all grooms; a session counts once for each
  [[nodiscard]] std::size_t upload_bytes() const { return upload_bytes_; }
  [[nodiscard]] std::size_t level_bytes() const { return level_bytes_; }

 private:
  enum class State : std::uint8_t {
    reading,  // in the cache, waiting for the builder or being read
    uploading,
    queued,
    building,
    ready,
  };
  struct Entry {
    State state = State::uploading;
    std::uint64_t byte_count = 0;  // of the upload, as the uploader announced; from building on, the real count
    std::uint64_t received = 0;
    std::vector<std::vector<std::uint8_t>> chunks;
    SessionId uploader = 0;
    bool is_mixed = false;  // the received bytes came from several uploaders
    // requested a second time: the uploader may still be sending the bytes of the first request
    bool is_asked_again = false;
    std::int64_t asked_ns = 0;  // when the bytes were requested from its uploader
    std::map<SessionId, std::uint64_t>
        users;                     // the size that each session has offered; 0: it has not offered, so it cannot upload
    std::size_t upload_bytes = 0;  // its share of the bytes of all uploads
    std::size_t level_bytes = 0;   // once ready; including the bytes of the file
    Bytes bytes;                   // of the file, from building on
    std::size_t strand_count = 0;  // from building on
    std::uint64_t used = 0;        // order of last use, to evict by
  };
  using Grooms = std::map<wire::GroomHash, Entry>;
  static constexpr std::uint64_t kNoStrandsMax = std::numeric_limits<std::uint64_t>::max();
  struct Account {
    TokenBucket bytes;
    std::uint32_t bearer = 0;                        // who shares strand_count_max
    std::uint64_t strand_count_max = kNoStrandsMax;  // of all sessions of the bearer
    // arrival of the uploader's last chunk, of any groom
    std::int64_t chunk_ns = std::numeric_limits<std::int64_t>::min();
  };

  static wire::GroomState state_of(const Entry& entry);
  Account& account(SessionId session, std::int64_t now_ns);
  // Why a session may not use the groom (grooms_.end(): not in memory) in addition to those it uses. Counts refusals.
  Refused check_retain(SessionId session, Grooms::const_iterator groom);
  // Why the strands of the groom are too many in addition to those that the session, or its bearer, uses. Counts
  // refusals.
  Refused check_strands(SessionId session, Grooms::const_iterator groom);
  // The strands of the groom and of all others that one of the sessions uses.
  [[nodiscard]] std::uint64_t strands_with(std::span<const SessionId> sessions, Grooms::const_iterator groom) const;
  // Why a session may not begin or continue to upload a groom of this size.
  Refused check_upload(SessionId session, std::uint64_t byte_count, std::int64_t now_ns);
  Refused offer_known(Grooms::iterator groom, SessionId session, const wire::GroomOffer& offer, std::int64_t now_ns);
  Refused make_place();  // makes room for one more groom
  Refused begin_upload(SessionId session, const wire::GroomOffer& offer, std::int64_t now_ns);
  // Continues after the received bytes, unless the uploader's groom has another length.
  void await_upload(Grooms::iterator groom, SessionId uploader, std::int64_t now_ns);
  static bool is_repeated(const Entry& entry, SessionId session, const wire::GroomChunk& chunk);
  Refused put_chunk(Grooms::iterator groom, SessionId session, wire::GroomChunk chunk, std::int64_t now_ns);
  Refused begin_reading(SessionId session, const wire::GroomHash& groom);
  void feed_builder();  // gives cached grooms to the builder
  Refused finish_upload(Grooms::iterator groom, std::int64_t now_ns);
  bool has_stalled(const Entry& entry, std::int64_t now_ns);
  // Asks another session that has offered the groom to continue the upload; without one, refuses the groom to all.
  void pass_on(Grooms::iterator groom, std::int64_t now_ns);
  void take(GroomResult result, std::int64_t now_ns);
  void take_building(Grooms::iterator groom, GroomResult result, std::int64_t now_ns);
  void take_ready(Grooms::iterator groom, GroomResult result, std::int64_t now_ns);
  void take_refused(Grooms::iterator groom, const GroomResult& result, std::int64_t now_ns);
  void hand_over(const GroomResult& read, std::int64_t now_ns);
  void refuse_user(Grooms::iterator groom, SessionId session, const Refused& refused, std::int64_t now_ns);
  void refuse_all(Grooms::iterator groom, const Refused& refused, Counter& counter, std::int64_t now_ns);
  void send(SessionId session, const wire::Message& message, std::int64_t now_ns);
  void send_state(Grooms::const_iterator groom, wire::GroomState state, std::int64_t now_ns);
  void set_upload_bytes(Entry& entry, std::size_t bytes);
  void erase(Grooms::iterator groom);
  void check_invariants() const;
  bool evict_one();  // the least recently used ready groom that no session uses

  GroomStoreLimits limits_;
  GroomBuilder* builder_;
  CommandQueue* commands_;
  GroomCounters* counters_;
  GroomListener listener_;
  Grooms grooms_;
  std::map<SessionId, Account> accounts_;
  std::deque<wire::GroomHash> to_read_;                                             // not yet given to the builder
  std::size_t reading_count_ = 0;                                                   // given to the builder
  std::map<wire::GroomHash, std::vector<SessionId>> fetches_;                       // requested from the builder
  std::map<wire::GroomHash, std::weak_ptr<const std::vector<std::uint8_t>>> read_;  // fetched, and still being sent
  std::size_t upload_bytes_ = 0, level_bytes_ = 0;
  std::uint64_t uses_ = 0;
  std::int64_t refresh_next_ns_ = 0;
};

}  // namespace hairnet::server
