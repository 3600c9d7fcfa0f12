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
  // A shared pointer to the bytes of a file; null where there is no file.
  using Bytes = GroomFiles::Bytes;
  // The builder, the queue and the counters must outlive the store. `listener.send` must be set; the other two
  // functions may be empty.
  GroomStore(const GroomStoreLimits& limits, GroomBuilder& builder, CommandQueue& commands, GroomCounters& counters,
             GroomListener listener);
  // The store cannot be copied, because its parts keep pointers to each other (`uploads_` and `turns_` to `shares_`).
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
  // Sessions of a draining server will soon come with these grooms. The store queues those that the cache or the object
  // store has, one at a time, while no groom of a session waits for the builder.
  void prepare(std::span<const wire::GroomHash> grooms, std::int64_t now_ns);
  void release(SessionId session, std::int64_t now_ns) override;
  // Takes the results of the builder, the learner and the object store, ends stalled uploads, and gives the builder and
  // the learner their next jobs. Call it often: the timeouts of uploads and the turns of builds depend on it.
  void poll(std::int64_t now_ns);
  // Evicts the least recently used groom that no session uses. If there is none, the upload that has received most
  // bytes is refused. Server::poll_io calls it while memory is full.
  void free_memory(std::int64_t now_ns);

  // True when the levels of the groom are built and in memory.
  [[nodiscard]] bool ready(const wire::GroomHash& groom) const;
  [[nodiscard]] std::size_t groom_count() const { return grooms_.size(); }
  // The sum of the users of all grooms. A session counts once for each groom that it uses.
  [[nodiscard]] std::size_t user_count() const;
  // The bytes in memory of unfinished uploads and of files that wait to be built (upload_bytes_max bounds them), and
  // the bytes of finished levels with their files (level_bytes_max bounds them).
  [[nodiscard]] std::size_t upload_bytes() const { return uploads_.bytes() + turns_.bytes(); }
  [[nodiscard]] std::size_t level_bytes() const { return level_bytes_; }

 private:
  // The way of a groom: uploading or searched, then queued, building and ready. A build that gives way goes from
  // building back to queued; a groom that is refused is erased.
  enum class State : std::uint8_t {
    uploading,
    // The object store is asked for the groom.
    searched,
    // The groom's file is in memory or in the cache, and waits for the builder.
    queued,
    building,
    ready,
  };
  struct User {
    // The size that it has offered; zero: it has not offered the groom, so it cannot upload it.
    std::uint64_t offered_bytes = 0;
    // GroomNeed has asked the session for its bytes. Its chunks may still arrive after another session has brought the
    // whole file, and then they are no error.
    bool was_asked = false;
  };
  struct Entry {
    State state = State::uploading;
    // Sessions that have offered or use the groom. It is not evicted while there is one.
    std::map<SessionId, User> users;
    // The time when a user, or the object store, was last asked for the bytes. check_uploads() measures
    // upload_patience_ns from it.
    std::int64_t asked_ns = 0;
    // The size of the file, from queued on; zero: it is not known yet.
    std::uint64_t byte_count = 0;
    // The file, and the number of strands in it. Both are known from the state building on.
    Bytes bytes;
    std::size_t strand_count = 0;
    // The files of its basis and its learnt hair, once the groom is ready; null: there is none.
    Bytes basis, learnt;
    // The levels, set once the groom is ready. The pointer is weak, because the tick owns the levels until ForgetGroom
    // reaches it.
    std::weak_ptr<const LevelSet> levels;
    // The memory of the levels and of the files together; zero until the groom is ready.
    std::size_t level_bytes = 0;
    // The value of uses_ when the groom was last used. evict_one() takes the smallest.
    std::uint64_t used = 0;
  };
  using Grooms = std::map<wire::GroomHash, Entry>;

  // The state as clients see it: uploading and searched grooms are `queued` for those who wait for them.
  static wire::GroomState state_of(const Entry& entry);
  // Returns the reason why a session may not use the groom in addition to those that it uses, and counts the refusal.
  // `groom` is end() when the groom is not in memory: then only the number of grooms is checked.
  Refused check_retain(SessionId session, Grooms::const_iterator groom);
  // Returns the reason why the strands of the groom are too many in addition to those that the session, or the holder
  // of its token, uses. Counts the refusal.
  Refused check_strands(SessionId session, Grooms::const_iterator groom);
  // The number of strands of the groom and of all other grooms that at least one of the sessions uses. Each groom
  // counts once.
  [[nodiscard]] std::uint64_t strands_with(std::span<const SessionId> sessions, Grooms::const_iterator groom) const;
  // Answers an offer of a groom that is in memory already. Refuses a size that differs from the known one: the same
  // hash cannot have two sizes.
  Refused offer_known(Grooms::iterator groom, SessionId session, const wire::GroomOffer& offer, std::int64_t now_ns);
  // Adds a groom whose file the cache has, with the session as its first user, and queues its build.
  Refused queue_cached(SessionId session, const wire::GroomHash& groom, std::int64_t now_ns);
  // Makes room for one more groom: evicts unused grooms, and else ends an upload of the sharer that holds most. Refuses
  // when neither is possible.
  Refused make_place(SessionId session, std::int64_t now_ns);
  // Makes room for one more groom that waits for the builder. A full queue loses the newest groom of the sharer that
  // has most there; refuses when that sharer is the session's own.
  Refused make_place_in_queue(SessionId session, std::int64_t now_ns);
  // Makes room for a chunk of this upload. The sharer whose uploads hold most bytes loses uploads until the chunk fits.
  // Returns false when the upload `id` itself was refused.
  bool make_room(const UploadId& id, std::size_t bytes, std::int64_t now_ns);
  // Evicts the least recently used ready groom that no session uses.
  bool evict_one();

  // Asks the object store for a new groom, while its users wait. Returns false when there is no store, or when it
  // cannot be asked now; then the caller asks a user for the bytes.
  bool search(Grooms::iterator groom, std::int64_t now_ns);
  // Queues the build of a groom that the object store had; otherwise asks a user for the bytes.
  void take_found(const ObjectSync::Found& found, std::int64_t now_ns);
  // Asks the session for the groom's bytes. Refuses when it has uploaded too much lately.
  Refused ask(Grooms::iterator groom, SessionId session, std::int64_t now_ns);
  // Asks users who have offered the groom, one after the other, until one may upload it: of each sharer one at a time,
  // so that nobody waits for many sessions of another. Refuses those who may not; returns false when none is left.
  bool ask_next(Grooms::iterator groom, std::int64_t now_ns);
  // Checks whether the upload is complete and has the offered hash, and queues the build of the groom.
  Refused finish_upload(Grooms::iterator groom, SessionId session, std::int64_t now_ns);
  // Ends the upload and refuses the groom to its session. Another user's bytes are asked for, or the groom is refused
  // to all.
  void refuse_upload(const UploadId& id, const Refused& refused, std::int64_t now_ns);
  // A source of the groom's bytes (an upload, the object store or the cache) is gone. If no other upload is under way,
  // the next user is asked for the bytes; without any, the groom is refused to all its users and erased.
  void go_on_without(Grooms::iterator groom, std::int64_t now_ns);
  // Refuses stalled uploads, and asks the next user where the first has kept the others waiting for upload_patience_ns.
  void check_uploads(std::int64_t now_ns);

  // Hands the groom to BuildTurns, as a build of `owner` (zero: nobody's). Without chunks the builder reads the file
  // from the cache.
  void queue(Grooms::iterator groom, SessionId owner, GroomUploads::Chunks chunks, std::int64_t now_ns);
  // Queues the next groom of to_prepare_ while the builder has nothing else to do.
  void queue_prepared(std::int64_t now_ns);
  // Takes one result of the builder. The next two functions take the results whose build has begun, or has made levels.
  void take(GroomResult result, std::int64_t now_ns);
  void take_building(Grooms::iterator groom, GroomResult result, std::int64_t now_ns);
  void take_ready(Grooms::iterator groom, GroomResult result, std::int64_t now_ns);
  // Takes the results of the learner, and gives it the next groom.
  void learn(std::int64_t now_ns);
  // Replaces the levels of a groom by the same levels with learnt hair. They may need more memory, so other grooms may
  // be evicted.
  void take_learnt(LearningResult result);

  // Removes the session from the users of the groom, and sends it the error and the state `refused`.
  void refuse_user(Grooms::iterator groom, SessionId session, const Refused& refused, std::int64_t now_ns);
  // Refuses users who have offered another size than the file has. It runs when the size becomes known: after the
  // upload, or once the file was read from the cache.
  void refuse_other_sizes(Grooms::iterator groom, std::int64_t now_ns);
  // Refuses the groom to all its users, and erases it.
  void refuse_all(Grooms::iterator groom, const Refused& refused, std::int64_t now_ns);
  void send_state(Grooms::const_iterator groom, wire::GroomState state, std::int64_t now_ns);
  // Forgets the groom everywhere: its uploads, its build, its learning, and through ForgetGroom its levels at the tick.
  void erase(Grooms::iterator groom);
  void check_invariants() const;

  GroomStoreLimits limits_;
  GroomBuilder* builder_;
  CommandQueue* commands_;
  GroomCounters* counters_;
  GroomListener listener_;
  ObjectSync* objects_ = nullptr;
  // The parts of the store: the store takes the results of one part and gives them to the next. No part knows the store
  // or another part, except that uploads_ and turns_ read shares_.
  GroomFiles files_;
  GroomShares shares_;
  GroomUploads uploads_;
  BuildTurns turns_;
  LearningTurns learning_;
  Grooms grooms_;
  // The grooms that prepare() has named and that wait until the builder is idle, in the order of the calls.
  std::deque<wire::GroomHash> to_prepare_;
  // The sum of the entries' level_bytes, which level_bytes_max bounds.
  std::size_t level_bytes_ = 0;
  // The number of uses of grooms so far. It serves as a clock for Entry::used, so that the order of uses needs no time.
  std::uint64_t uses_ = 0;
  // poll() lists the folder of the cache again at this time.
  std::int64_t refresh_next_ns_ = 0;
};

}  // namespace hairnet::server
