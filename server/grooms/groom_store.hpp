#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <span>
#include <tuple>
#include <vector>

#include "schema/bytes/content_hash.hpp"
#include "schema/wire/groom_file.hpp"
#include "server/exchange/command.hpp"
#include "server/exchange/groom_service.hpp"
#include "server/grooms/groom_builder.hpp"
#include "server/grooms/groom_counters.hpp"
#include "server/grooms/hair_learner.hpp"
#include "server/grooms/object_sync.hpp"
#include "server/threading/token_bucket.hpp"

namespace hairnet::server {

// When the hair of a groom is learnt.
enum class Learning : std::uint8_t {
  never,
  when_short,  // of time: characters have been below the level that their owners asked for, for a while
  always,
};

struct GroomStoreLimits {
  std::size_t groom_bytes_max = std::size_t{64} << 20;    // of one groom
  std::size_t upload_bytes_max = std::size_t{256} << 20;  // received for all unfinished uploads and waiting builds
  std::size_t level_bytes_max = std::size_t{4} << 30;     // of all levels, and of the files of their grooms
  std::size_t groom_count_max = 1024;
  std::size_t grooms_per_session_max = 64;
  std::size_t strands_per_session_max = 1'000'000;  // of all grooms that a session uses
  double upload_bytes_per_s = 16.0 * (1 << 20);     // of a session, as announced
  double upload_burst_bytes = 256.0 * (1 << 20);
  std::size_t build_queue_max = 64;  // grooms that wait for the builder
  // What the uploads of a session must bring together in each upload_timeout_ns.
  double upload_bytes_per_s_min = 8.0 * (1 << 10);
  std::int64_t upload_timeout_ns = 30'000'000'000;
  // After this time a session that waits for another's upload of the same groom is asked for its own.
  std::int64_t upload_patience_ns = 5'000'000'000;
  std::int64_t build_ns_max = 600'000'000'000;  // the builder has low priority, so a busy machine needs long
  std::size_t build_memory_bytes_max = std::size_t{2} << 30;
  // After this time a build gives way to one of a session whose builds have taken less. It begins again later, with
  // twice the time.
  std::int64_t build_turn_ns = 5'000'000'000;
  // A build that fails by a fault of the server begins again after this time, the next after twice this time, and so
  // on.
  std::int64_t build_again_ns = 1'000'000'000;
  int build_count_max = 4;
  Learning learning = Learning::when_short;
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

// All grooms by content hash, from offer to built levels. Sessions that offer the same hash wait for the first one's
// upload, but not for long: then the next is asked for its own. Each session's bytes stay apart, so no session can
// delay or spoil a groom for another. A groom in the cache is not uploaded. Nor is one in the object store: its users
// wait for the store, but no longer than for another's upload. One groom is built at a time: of the sessions that wait,
// the one whose builds have taken the least time is next, and a long build gives way. A groom that no session uses is
// dropped until it is ready, and then stays until its memory is needed. I/O thread.
class GroomStore final : public GroomService {
 public:
  using Bytes = std::shared_ptr<const std::vector<std::uint8_t>>;
  GroomStore(const GroomStoreLimits& limits, GroomBuilder& builder, CommandQueue& commands, GroomCounters& counters,
             GroomListener listener);

  // Without a learner, no hair is learnt. `is_short`: the tick has too little time for the levels asked for.
  void learn_with(HairLearner& learner, std::function<bool()> is_short);

  // From now on a groom that nobody here has is first looked for in the object store, before its upload is asked for.
  void find_in(ObjectSync& objects) { objects_ = &objects; }

  void open(SessionId session, const GroomShare& share, std::int64_t now_ns) override;
  Refused offer(SessionId session, const wire::GroomOffer& offer, std::int64_t now_ns) override;
  ChunkAnswer chunk(SessionId session, wire::GroomChunk chunk, std::int64_t now_ns) override;
  Refused retain(SessionId session, const wire::GroomHash& groom, std::int64_t now_ns) override;
  void resend_states(SessionId session, std::int64_t now_ns) override;
  Bytes bytes(const wire::GroomHash& groom) override;
  bool fetch(SessionId session, const wire::GroomHash& groom) override;
  [[nodiscard]] bool is_cached(const wire::GroomHash& groom) const override { return builder_->is_cached(groom); }
  [[nodiscard]] std::vector<wire::GroomHash> in_use() const override;
  // Sessions will soon use these: makes those ready that the cache or the object store has, when no session's groom
  // waits for the builder.
  void prepare(std::span<const wire::GroomHash> grooms, std::int64_t now_ns);
  void release(SessionId session, std::int64_t now_ns) override;
  void poll(std::int64_t now_ns);  // results of the builder, stalled uploads
  // Evicts a groom that nobody uses; if there is none, ends the upload that holds most.
  void free_memory(std::int64_t now_ns);

  [[nodiscard]] bool ready(const wire::GroomHash& groom) const;
  [[nodiscard]] std::size_t groom_count() const { return grooms_.size(); }
  [[nodiscard]] std::size_t user_count() const;  // of all grooms; a session counts once for each
  [[nodiscard]] std::size_t upload_bytes() const { return upload_bytes_; }
  [[nodiscard]] std::size_t level_bytes() const { return level_bytes_; }

 private:
  enum class State : std::uint8_t {
    uploading,
    searched,  // in the object store
    queued,    // its bytes are here, or in the cache
    building,
    ready,
  };
  struct User {
    std::uint64_t offered_bytes = 0;  // 0: it has not offered the groom, so it cannot upload it
    bool was_asked = false;           // for its bytes; those that still come are no fault
  };
  struct Upload {
    std::uint64_t received = 0;
    std::vector<std::vector<std::uint8_t>> chunks;
    bytes::ContentHasher hasher;
  };
  struct Entry {
    State state = State::uploading;
    std::map<SessionId, User> users;
    std::map<SessionId, Upload> uploads;            // while uploading; of users
    std::int64_t asked_ns = 0;                      // when a user, or the object store, was last asked for the bytes
    std::vector<std::vector<std::uint8_t>> chunks;  // of the file, while queued; none: it is in the cache
    SessionId owner =
        0;  // uploaded it, or asked for the cached one; its build counts as theirs; 0: none, it is prepared
    std::uint64_t order = 0;                       // of coming into the queue
    std::uint64_t job = 0;                         // the builder's number, while it has the groom; else 0
    std::uint64_t byte_count = 0;                  // of the file, from queued on; 0: not known yet
    std::size_t upload_bytes = 0;                  // that it holds before it is ready
    std::size_t level_bytes = 0;                   // once ready; including the bytes of the file
    Bytes bytes;                                   // of the file, from building on
    Bytes basis, learnt;                           // of the files of its basis and learnt hair, once ready; null: none
    std::weak_ptr<const LevelSet> levels;          // once ready
    bool was_learnt = false;                       // or refused, or is being learnt
    std::int64_t built_since_ns = 0, turn_ns = 0;  // while building: since when, and how long it need not give way
    std::int64_t charged_ns = 0;                   // of the build under way, to its owner
    bool gives_way = false;                        // while building: the builder was told to end it
    std::size_t strand_count = 0;                  // from building on
    int build_count = 0;                           // that have failed by the server's fault
    std::int64_t build_again_ns = 0;               // while queued: not before
    std::uint64_t used = 0;                        // order of last use, to evict by
  };
  using Grooms = std::map<wire::GroomHash, Entry>;
  struct Account {
    TokenBucket bytes;
    GroomShare share = {};
    // What its uploads brought since a time. They stall when that is too little.
    std::int64_t since_ns = 0;
    std::uint64_t received = 0;
    std::size_t upload_count = 0;  // under way
  };

  // A subject of sessions, or one session: who takes turns with others.
  using Sharer = std::pair<std::uint32_t, SessionId>;
  [[nodiscard]] Sharer sharer_of(SessionId session) const;

  static wire::GroomState state_of(const Entry& entry);
  Account& account(SessionId session, std::int64_t now_ns);
  // Why a session may not use the groom (grooms_.end(): not in memory) in addition to those it uses. Counts refusals.
  Refused check_retain(SessionId session, Grooms::const_iterator groom);
  // Why the strands of the groom are too many in addition to those that the session, or its bearer, uses. Counts
  // refusals.
  Refused check_strands(SessionId session, Grooms::const_iterator groom);
  // The strands of the groom and of all others that one of the sessions uses.
  [[nodiscard]] std::uint64_t strands_with(std::span<const SessionId> sessions, Grooms::const_iterator groom) const;
  Refused offer_known(Grooms::iterator groom, SessionId session, const wire::GroomOffer& offer, std::int64_t now_ns);
  Refused make_place(SessionId session, std::int64_t now_ns);  // makes room for one more groom
  // Looks for a new groom in the object store; its users wait. False when that cannot be now.
  bool search(Grooms::iterator groom, std::int64_t now_ns);
  void take_found(const ObjectSync::Found& found, std::int64_t now_ns);
  // Asks the session for the groom's bytes. Refuses when it has uploaded too much lately.
  Refused ask(Grooms::iterator groom, SessionId session, std::int64_t now_ns);
  // Asks users who have offered the groom, one after the other, until one may upload it: of each sharer one at a time,
  // so that nobody waits for many sessions of another. False: there is none; those who may not have been refused.
  bool ask_next(Grooms::iterator groom, std::int64_t now_ns);
  Refused put_chunk(Grooms::iterator groom, SessionId session, wire::GroomChunk chunk, std::int64_t now_ns);
  // Frees memory for a chunk, at the cost of the sharer whose unfinished uploads hold most. False when that is the
  // session's own.
  bool make_room(SessionId session, std::size_t bytes, std::int64_t now_ns);
  Refused finish_upload(Grooms::iterator groom, SessionId session, std::int64_t now_ns);
  void end_upload(Grooms::iterator groom, SessionId session);
  // The upload is refused; the groom goes on with another user's bytes, or is refused to all.
  void refuse_upload(Grooms::iterator groom, SessionId session, const Refused& refused, std::int64_t now_ns);
  void go_on_without(Grooms::iterator groom, std::int64_t now_ns);
  Refused queue_cached(SessionId session, const wire::GroomHash& groom, std::int64_t now_ns);
  void queue(Entry& entry, SessionId owner);
  Refused make_place_in_queue(SessionId session, std::int64_t now_ns);
  void feed_builder();
  void queue_prepared(std::int64_t now_ns);
  void end_turn(std::int64_t now_ns);                // of the build under way, if it has lasted and another waits
  void charge(Entry& entry, std::int64_t build_ns);  // counts the build's time so far as its owner's
  // When a groom's turn to be built comes: owners that have left are last, then those whose builds have taken more
  // time.
  using Turn = std::tuple<bool, std::int64_t, std::uint64_t>;
  [[nodiscard]] Turn turn_of(const Entry& entry) const;
  [[nodiscard]] Grooms::iterator next_to_build();  // end(): none waits that may begin
  void check_uploads(std::int64_t now_ns);
  void take(GroomResult result, std::int64_t now_ns);
  // False when the build has been tried often enough.
  bool build_again(Grooms::iterator groom, const GroomResult& result, std::int64_t now_ns);
  void take_building(Grooms::iterator groom, GroomResult result, std::int64_t now_ns);
  void take_ready(Grooms::iterator groom, GroomResult result, std::int64_t now_ns);
  void learn(std::int64_t now_ns);
  void take_learnt(LearningResult result);
  wire::GroomHash offer_made(const Bytes& file);  // to clients, while the groom has it
  void hand_over(const GroomResult& read, std::int64_t now_ns);
  void refuse_user(Grooms::iterator groom, SessionId session, const Refused& refused, std::int64_t now_ns);
  void refuse_other_size(Grooms::iterator groom, SessionId session, std::int64_t now_ns);  // than the groom's
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
  std::map<Sharer, std::int64_t> build_ns_;  // that the builds of each have taken together; of those that have sessions
  std::map<wire::GroomHash, std::vector<SessionId>> fetches_;                       // requested from the builder
  std::map<wire::GroomHash, std::weak_ptr<const std::vector<std::uint8_t>>> read_;  // fetched, and still being sent
  std::map<wire::GroomHash, std::weak_ptr<const std::vector<std::uint8_t>>>
      made_;  // files of bases and learnt hair of ready grooms, by their own hash
  std::size_t upload_bytes_ = 0, level_bytes_ = 0;
  std::uint64_t uses_ = 0, orders_ = 0;
  std::uint64_t jobs_ = 0;  // given to the builder
  bool is_builder_busy_ = false;
  std::int64_t now_ns_ = 0;  // at the last poll
  std::int64_t refresh_next_ns_ = 0;
  HairLearner* learner_ = nullptr;
  std::function<bool()> is_short_;
  std::optional<std::int64_t> short_since_ns_;
  std::optional<wire::GroomHash> learning_;  // under way
  ObjectSync* objects_ = nullptr;
  std::set<wire::GroomHash> searches_;  // under way
  std::deque<wire::GroomHash> to_prepare_;
};

}  // namespace hairnet::server
