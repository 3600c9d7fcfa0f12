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
  // Waits until time is short: characters have been below the level that their owners asked for, for a while.
  when_short,
  always,
};

struct GroomStoreLimits {
  // Bounds one groom.
  std::size_t groom_bytes_max = std::size_t{64} << 20;
  // Bounds what is received for all unfinished uploads and waiting builds.
  std::size_t upload_bytes_max = std::size_t{256} << 20;
  // Bounds all levels, and the files of their grooms.
  std::size_t level_bytes_max = std::size_t{4} << 30;
  std::size_t groom_count_max = 1024;
  std::size_t grooms_per_session_max = 64;
  // Bounds all grooms that a session uses together.
  std::size_t strands_per_session_max = 1'000'000;
  // These bound the uploads of a session, by the sizes that it announces.
  double upload_bytes_per_s = 16.0 * (1 << 20);
  double upload_burst_bytes = 256.0 * (1 << 20);
  // This many grooms may wait for the builder.
  std::size_t build_queue_max = 64;
  // The uploads of a session must bring this much together, over each upload_timeout_ns.
  double upload_bytes_per_s_min = 8.0 * (1 << 10);
  std::int64_t upload_timeout_ns = 30'000'000'000;
  // After this time a session that waits for another's upload of the same groom is asked for its own.
  std::int64_t upload_patience_ns = 5'000'000'000;
  // Is long, since the builder has low priority on a machine that may be busy.
  std::int64_t build_ns_max = 600'000'000'000;
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
  // Takes results of the builder, and ends stalled uploads.
  void poll(std::int64_t now_ns);
  // Evicts a groom that nobody uses; if there is none, ends the upload that holds most.
  void free_memory(std::int64_t now_ns);

  [[nodiscard]] bool ready(const wire::GroomHash& groom) const;
  [[nodiscard]] std::size_t groom_count() const { return grooms_.size(); }
  // Counts users of all grooms; a session counts once for each.
  [[nodiscard]] std::size_t user_count() const;
  [[nodiscard]] std::size_t upload_bytes() const { return upload_bytes_; }
  [[nodiscard]] std::size_t level_bytes() const { return level_bytes_; }

 private:
  enum class State : std::uint8_t {
    uploading,
    // It is looked for in the object store.
    searched,
    // Its bytes are here, or in the cache.
    queued,
    building,
    ready,
  };
  struct User {
    // Is zero when it has not offered the groom, so it cannot upload it.
    std::uint64_t offered_bytes = 0;
    // It was asked for its bytes; those that still come are no fault.
    bool was_asked = false;
  };
  struct Upload {
    std::uint64_t received = 0;
    std::vector<std::vector<std::uint8_t>> chunks;
    bytes::ContentHasher hasher;
  };
  struct Entry {
    State state = State::uploading;
    std::map<SessionId, User> users;
    // These belong to users, in `uploading`.
    std::map<SessionId, Upload> uploads;
    // A user, or the object store, was last asked for the bytes at this time.
    std::int64_t asked_ns = 0;
    // These are the file, in `queued`; none: it is in the cache.
    std::vector<std::vector<std::uint8_t>> chunks;
    // This session uploaded it, or asked for the cached one, and the build counts as its own; zero: nobody did, it is
    // prepared.
    SessionId owner = 0;
    // Orders grooms by when they came into the queue.
    std::uint64_t order = 0;
    // Is the builder's number while it has the groom, else zero.
    std::uint64_t job = 0;
    // Is the size of the file, from queued on; zero: it is not known yet.
    std::uint64_t byte_count = 0;
    // The groom holds this much before it is ready.
    std::size_t upload_bytes = 0;
    // Includes the bytes of the file, once it is ready.
    std::size_t level_bytes = 0;
    // Is the file, from building on.
    Bytes bytes;
    // These are the files of its basis and learnt hair, once it is ready; null: none.
    Bytes basis, learnt;
    // Is set once it is ready.
    std::weak_ptr<const LevelSet> levels;
    // Its hair was learnt or refused, or is being learnt.
    bool was_learnt = false;
    // It is being built since then, and need not give way for this long.
    std::int64_t built_since_ns = 0, turn_ns = 0;
    // Its owner has been charged this much of the build under way.
    std::int64_t charged_ns = 0;
    // The builder was told to end its build.
    bool gives_way = false;
    // Is known from building on.
    std::size_t strand_count = 0;
    // This many builds have failed by the server's fault.
    int build_count = 0;
    // It is not built before this time, in `queued`.
    std::int64_t build_again_ns = 0;
    // Orders grooms by their last use, to evict by.
    std::uint64_t used = 0;
  };
  using Grooms = std::map<wire::GroomHash, Entry>;
  struct Account {
    TokenBucket bytes;
    GroomShare share = {};
    // Its uploads have brought `received` since this time. They stall when that is too little.
    std::int64_t since_ns = 0;
    std::uint64_t received = 0;
    // Counts uploads under way.
    std::size_t upload_count = 0;
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
  // Makes room for one more groom.
  Refused make_place(SessionId session, std::int64_t now_ns);
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
  // Ends the turn of the build under way, if it has lasted and another waits.
  void end_turn(std::int64_t now_ns);
  // Counts the build's time so far as its owner's.
  void charge(Entry& entry, std::int64_t build_ns);
  // When a groom's turn to be built comes: owners that have left are last, then those whose builds have taken more
  // time.
  using Turn = std::tuple<bool, std::int64_t, std::uint64_t>;
  [[nodiscard]] Turn turn_of(const Entry& entry) const;
  // Returns end() when none waits that may begin.
  [[nodiscard]] Grooms::iterator next_to_build();
  void check_uploads(std::int64_t now_ns);
  void take(GroomResult result, std::int64_t now_ns);
  // False when the build has been tried often enough.
  bool build_again(Grooms::iterator groom, const GroomResult& result, std::int64_t now_ns);
  void take_building(Grooms::iterator groom, GroomResult result, std::int64_t now_ns);
  void take_ready(Grooms::iterator groom, GroomResult result, std::int64_t now_ns);
  void learn(std::int64_t now_ns);
  void take_learnt(LearningResult result);
  // Offers the file to clients while the groom has it.
  wire::GroomHash offer_made(const Bytes& file);
  void hand_over(const GroomResult& read, std::int64_t now_ns);
  void refuse_user(Grooms::iterator groom, SessionId session, const Refused& refused, std::int64_t now_ns);
  // Refuses a session that has offered another size than the groom's.
  void refuse_other_size(Grooms::iterator groom, SessionId session, std::int64_t now_ns);
  void refuse_all(Grooms::iterator groom, const Refused& refused, Counter& counter, std::int64_t now_ns);
  void send(SessionId session, const wire::Message& message, std::int64_t now_ns);
  void send_state(Grooms::const_iterator groom, wire::GroomState state, std::int64_t now_ns);
  void set_upload_bytes(Entry& entry, std::size_t bytes);
  void erase(Grooms::iterator groom);
  void check_invariants() const;
  // Evicts the least recently used ready groom that no session uses.
  bool evict_one();

  GroomStoreLimits limits_;
  GroomBuilder* builder_;
  CommandQueue* commands_;
  GroomCounters* counters_;
  GroomListener listener_;
  Grooms grooms_;
  std::map<SessionId, Account> accounts_;
  // The builds of each have taken this time together. A sharer without sessions is forgotten.
  std::map<Sharer, std::int64_t> build_ns_;
  // The builder was asked for these.
  std::map<wire::GroomHash, std::vector<SessionId>> fetches_;
  // These were fetched, and are still being sent.
  std::map<wire::GroomHash, std::weak_ptr<const std::vector<std::uint8_t>>> read_;
  // These are the files of bases and learnt hair of ready grooms, by their own hash.
  std::map<wire::GroomHash, std::weak_ptr<const std::vector<std::uint8_t>>> made_;
  std::size_t upload_bytes_ = 0, level_bytes_ = 0;
  std::uint64_t uses_ = 0, orders_ = 0;
  // Counts jobs given to the builder.
  std::uint64_t jobs_ = 0;
  bool is_builder_busy_ = false;
  // Is the time of the last poll.
  std::int64_t now_ns_ = 0;
  std::int64_t refresh_next_ns_ = 0;
  HairLearner* learner_ = nullptr;
  std::function<bool()> is_short_;
  std::optional<std::int64_t> short_since_ns_;
  // Is under way.
  std::optional<wire::GroomHash> learning_;
  ObjectSync* objects_ = nullptr;
  // These are under way.
  std::set<wire::GroomHash> searches_;
  std::deque<wire::GroomHash> to_prepare_;
};

}  // namespace hairnet::server
