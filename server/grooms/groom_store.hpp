#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <span>
#include <utility>
#include <vector>

#include "schema/wire/groom_file.hpp"
#include "server/exchange/command.hpp"
#include "server/exchange/groom_service.hpp"
#include "server/grooms/build_turns.hpp"
#include "server/grooms/groom_files.hpp"
#include "server/grooms/groom_shares.hpp"
#include "server/grooms/groom_uploads.hpp"
#include "server/grooms/learning_turns.hpp"
#include "server/grooms/object_sync.hpp"

namespace hairnet::server {

// These functions bring messages, files and revoked grooms to sessions.
struct GroomListener {
  std::function<void(SessionId, const wire::Message&, std::int64_t now_ns)> send;
  // Brings the result of fetch(); null when the file could not be read.
  std::function<void(SessionId, const wire::GroomHash&, std::shared_ptr<const std::vector<std::uint8_t>>,
                     std::int64_t now_ns)>
      deliver;
  // The session may not use the groom any more: remove its characters with this groom.
  std::function<void(SessionId, const wire::GroomHash&, std::int64_t now_ns)> revoke;
};

// Keeps all grooms by content hash, from offer to built levels, with their users and their memory. It asks sessions for
// bytes (GroomUploads), looks for grooms in the object store (ObjectSync), and hands them on to be built (BuildTurns)
// and learnt (LearningTurns). Sessions that offer the same hash wait for the first one's upload or for the object
// store, but not for long: then the next is asked for its own bytes. A groom in the cache is not uploaded. A groom that
// no session uses is dropped until it is ready, and then stays until its memory is needed. I/O thread.
class GroomStore final : public GroomService {
 public:
  using Bytes = GroomFiles::Bytes;
  GroomStore(const GroomStoreLimits& limits, GroomBuilder& builder, CommandQueue& commands, GroomCounters& counters,
             GroomListener listener);
  // Its parts refer to each other.
  GroomStore(const GroomStore&) = delete;
  GroomStore& operator=(const GroomStore&) = delete;

  // Without a learner no hair is learnt. `is_short`: the tick has too little time for the levels asked for.
  void learn_with(HairLearner& learner, std::function<bool()> is_short) {
    learning_.learn_with(learner, std::move(is_short));
  }
  // From now on a groom that nobody here has is first looked for in the object store, before its upload is asked for.
  void find_in(ObjectSync& objects) { objects_ = &objects; }

  void open(SessionId session, const GroomShare& share, std::int64_t /*now_ns*/) override {
    shares_.open(session, share);
  }
  Refused offer(SessionId session, const wire::GroomOffer& offer, std::int64_t now_ns) override;
  ChunkAnswer chunk(SessionId session, wire::GroomChunk chunk, std::int64_t now_ns) override;
  Refused retain(SessionId session, const wire::GroomHash& groom, std::int64_t now_ns) override;
  void resend_states(SessionId session, std::int64_t now_ns) override;
  Bytes bytes(const wire::GroomHash& groom) override;
  bool fetch(SessionId session, const wire::GroomHash& groom) override { return files_.fetch(session, groom); }
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
  [[nodiscard]] std::size_t upload_bytes() const { return uploads_.bytes() + turns_.bytes(); }
  [[nodiscard]] std::size_t level_bytes() const { return level_bytes_; }

 private:
  // The way of a groom: uploading or searched, then queued, building and ready. A build that gives way goes from
  // building back to queued; a groom that is refused is erased.
  enum class State : std::uint8_t {
    uploading,
    // The object store is asked for the groom.
    searched,
    // Its bytes are here, or in the cache.
    queued,
    building,
    ready,
  };
  struct User {
    // The size that it has offered; zero: it has not offered the groom, so it cannot upload it.
    std::uint64_t offered_bytes = 0;
    // The session was asked for its bytes. Bytes that come after another session has brought them are no error.
    bool was_asked = false;
  };
  struct Entry {
    State state = State::uploading;
    // Sessions that have offered or use the groom. It is not evicted while there is one.
    std::map<SessionId, User> users;
    // A user, or the object store, was last asked for the bytes at this time.
    std::int64_t asked_ns = 0;
    // The size of the file, from queued on; zero: it is not known yet.
    std::uint64_t byte_count = 0;
    // These two are known from building on.
    Bytes bytes;
    std::size_t strand_count = 0;
    // The files of its basis and its learnt hair, once the groom is ready; null: there is none.
    Bytes basis, learnt;
    // Set once the groom is ready. Weak, because the tick owns the levels, until ForgetGroom reaches it.
    std::weak_ptr<const LevelSet> levels;
    // Includes the bytes of the files, once it is ready.
    std::size_t level_bytes = 0;
    // Orders grooms by their last use, to evict by.
    std::uint64_t used = 0;
  };
  using Grooms = std::map<wire::GroomHash, Entry>;

  static wire::GroomState state_of(const Entry& entry);
  // Says why a session may not use the groom (end(): not in memory) in addition to those it uses. Counts refusals.
  Refused check_retain(SessionId session, Grooms::const_iterator groom);
  // Says why the strands of the groom are too many in addition to those that the session, or its holder, uses. Counts
  // refusals.
  Refused check_strands(SessionId session, Grooms::const_iterator groom);
  // Counts the strands of the groom and of all others that one of the sessions uses.
  [[nodiscard]] std::uint64_t strands_with(std::span<const SessionId> sessions, Grooms::const_iterator groom) const;
  Refused offer_known(Grooms::iterator groom, SessionId session, const wire::GroomOffer& offer, std::int64_t now_ns);
  Refused queue_cached(SessionId session, const wire::GroomHash& groom, std::int64_t now_ns);
  // Makes room for one more groom.
  Refused make_place(SessionId session, std::int64_t now_ns);
  // Makes room for one more groom that waits for the builder.
  Refused make_place_in_queue(SessionId session, std::int64_t now_ns);
  // Makes room for a chunk of this upload. The sharer whose uploads hold most loses one; false: that was this upload.
  bool make_room(const UploadId& id, std::size_t bytes, std::int64_t now_ns);
  // Evicts the least recently used ready groom that no session uses.
  bool evict_one();

  // Looks for a new groom in the object store; its users wait. Returns false when that cannot be now.
  bool search(Grooms::iterator groom, std::int64_t now_ns);
  void take_found(const ObjectSync::Found& found, std::int64_t now_ns);
  // Asks the session for the groom's bytes. Refuses when it has uploaded too much lately.
  Refused ask(Grooms::iterator groom, SessionId session, std::int64_t now_ns);
  // Asks users who have offered the groom, one after the other, until one may upload it: of each sharer one at a time,
  // so that nobody waits for many sessions of another. Refuses those who may not; returns false when none is left.
  bool ask_next(Grooms::iterator groom, std::int64_t now_ns);
  Refused finish_upload(Grooms::iterator groom, SessionId session, std::int64_t now_ns);
  // The upload is refused; the groom goes on with another user's bytes, or is refused to all.
  void refuse_upload(const UploadId& id, const Refused& refused, std::int64_t now_ns);
  void go_on_without(Grooms::iterator groom, std::int64_t now_ns);
  void check_uploads(std::int64_t now_ns);

  void queue(Grooms::iterator groom, SessionId owner, GroomUploads::Chunks chunks, std::int64_t now_ns);
  // Queues one of those to prepare, when the builder has nothing else to do.
  void queue_prepared(std::int64_t now_ns);
  void take(GroomResult result, std::int64_t now_ns);
  void take_building(Grooms::iterator groom, GroomResult result, std::int64_t now_ns);
  void take_ready(Grooms::iterator groom, GroomResult result, std::int64_t now_ns);
  void learn(std::int64_t now_ns);
  void take_learnt(LearningResult result);

  void refuse_user(Grooms::iterator groom, SessionId session, const Refused& refused, std::int64_t now_ns);
  // Refuses users who have offered another size than the groom's.
  void refuse_other_sizes(Grooms::iterator groom, std::int64_t now_ns);
  void refuse_all(Grooms::iterator groom, const Refused& refused, std::int64_t now_ns);
  void send_state(Grooms::const_iterator groom, wire::GroomState state, std::int64_t now_ns);
  void erase(Grooms::iterator groom);
  void check_invariants() const;

  GroomStoreLimits limits_;
  GroomBuilder* builder_;
  CommandQueue* commands_;
  GroomCounters* counters_;
  GroomListener listener_;
  ObjectSync* objects_ = nullptr;
  // None of the parts below knows the store: it passes on what one has to tell another.
  GroomFiles files_;
  GroomShares shares_;
  GroomUploads uploads_;
  BuildTurns turns_;
  LearningTurns learning_;
  Grooms grooms_;
  // Grooms of a draining server's rooms, in the order of their use there.
  std::deque<wire::GroomHash> to_prepare_;
  // The sum of the entries' level_bytes, which level_bytes_max bounds.
  std::size_t level_bytes_ = 0;
  // Counts uses of grooms: a clock for `used`, which needs no time.
  std::uint64_t uses_ = 0;
  std::int64_t refresh_next_ns_ = 0;
};

}  // namespace hairnet::server
