#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include "core/result.hpp"
#include "server/app/config.hpp"
#include "server/app/largest_room.hpp"
#include "server/app/memory_watch.hpp"
#include "server/app/metrics.hpp"
#include "server/app/revoked_tokens_file.hpp"
#include "server/grooms/groom_store.hpp"
#include "server/session/session_registry.hpp"
#include "server/threading/worker_pool.hpp"
#include "server/tick/recorder.hpp"
#include "server/tick/scheduler.hpp"

namespace hairnet::server {

// The whole server without sockets, duty threads and a clock. It has six duties, each for one thread: I/O
// (sessions and groom store), tick, builder, learner, objects, recorder. Duties exchange data through bounded queues
// only, so poll() can also run all of them in turn on one thread. The server owns the helper threads of the tick's and
// the build's loops, and reads the wall clock to check when tokens expire.
class Server {
 public:
  // `metrics` must outlive the server. Ticks are counted from `now_ns`. `clock`, which any thread may call, measures
  // the duration of work; without one nothing is measured and every character is stepped at the level that its owner
  // asked for. `build_levels` builds the grooms, on the builder thread. `memory` may be empty. `learn_hair` runs on the
  // learner thread. `objects` may be null, and must outlive the server: it is asked on the builder and objects threads.
  static Result<std::unique_ptr<Server>> create(const Config& config, Metrics& metrics, std::int64_t now_ns,
                                                ClockNs clock = nullptr,
                                                const BuildLevels& build_levels = build_levels_in_process,
                                                ProcessMemory memory = {},
                                                const LearnHair& learn_hair = learn_hair_in_process,
                                                ObjectStore* objects = nullptr);

  // The calls up to poll_tick() are for the I/O thread. This one begins a session; null: it was refused and
  // `connection` has been closed.
  PacketSink* open(std::shared_ptr<Connection> connection, std::int64_t now_ns);
  // Time-outs of sessions, results of groom jobs, memory and revoked tokens. Call it often, and when a job has a
  // result.
  void poll_io(std::int64_t now_ns);
  // Sends what the last tick has put into the outboxes.
  void flush(std::int64_t now_ns) { sessions_.flush(now_ns); }
  // Ends all sessions: rooms move to other servers for `send_on_ns` at most, then clients get a Goodbye.
  void drain(std::int64_t send_on_ns, std::int64_t now_ns) { sessions_.drain(send_on_ns, now_ns); }
  // Replaces the system's clock by this function of seconds since 1970; for tests.
  void set_unix_clock(std::function<std::int64_t()> unix_time_s) { context_.unix_time_s = std::move(unix_time_s); }
  // From now on the server has only the rooms that it owns in this directory, which must outlive the server.
  void join_fleet(Directory& fleet) { context_.fleet = &fleet; }
  // The directory has decided about a room: this server owns it from now on, with the text `kept` that the former owner
  // has stored, or owns it no more.
  void on_room_claimed(const std::string& room, const std::string& kept, std::int64_t now_ns) {
    sessions_.on_room_claimed(room, kept, now_ns);
  }
  void on_room_lost(const std::string& room, std::int64_t now_ns) { sessions_.on_room_lost(room, now_ns); }
  // Rooms that use these grooms may come to this server soon.
  void prepare(std::span<const wire::GroomHash> grooms, std::int64_t now_ns) { grooms_.prepare(grooms, now_ns); }
  // Gives a room of this server up to the server with the id `to`, with its clients.
  void hand_over(const std::string& room, std::uint64_t to, std::int64_t now_ns) {
    sessions_.hand_over(room, to, now_ns);
  }
  // Returns why the holder of that token may not enter the room, not even to observe; empty: it may.
  [[nodiscard]] std::string why_refused(std::string_view token, const std::string& room) const;
  [[nodiscard]] std::size_t session_count() const { return sessions_.count(); }
  // New clients and new characters of this room are refused from now on, because this server has no time for them. An
  // empty name: no room is overloaded.
  void set_overloaded_room(const std::string& room) { context_.overloaded_room = room; }
  [[nodiscard]] RoomLoad largest_room() const;
  [[nodiscard]] std::size_t character_count(const std::string& room) const {
    return context_.rooms.count(room).characters;
  }
  // Whether there is a place for one more client, and memory.
  [[nodiscard]] bool takes_clients() const {
    return context_.session_count < context_.limits.session_count_max && !is_memory_full();
  }
  // Tick thread. True when a tick has run: there may be something to flush.
  bool poll_tick(std::int64_t now_ns);
  [[nodiscard]] std::int64_t next_tick_ns() const { return tick_clock_.next_due_ns(); }
  // Builder thread.
  bool poll_builder() { return builder_.poll(); }
  // Learner thread.
  bool poll_learner() { return learner_.poll(); }
  // Objects thread.
  bool poll_objects() { return object_sync_ && object_sync_->poll(); }
  // Recorder thread.
  bool poll_recorder() { return recorder_ && recorder_->poll(); }

  // All duties in turn, for tests.
  void poll(std::int64_t now_ns);

  [[nodiscard]] GroomBuilder& builder() { return builder_; }
  [[nodiscard]] HairLearner& learner() { return learner_; }
  // Null: there is no object store.
  [[nodiscard]] ObjectSync* object_sync() { return object_sync_ ? &*object_sync_ : nullptr; }
  [[nodiscard]] Recorder* recorder() { return recorder_.get(); }
  // For tests that run all duties on one thread.
  [[nodiscard]] const Scheduler& scheduler() const { return scheduler_; }
  [[nodiscard]] const SessionRegistry& sessions() const { return sessions_; }
  [[nodiscard]] const SessionContext& context() const { return context_; }
  [[nodiscard]] const GroomStore& grooms() const { return grooms_; }
  // True while sessions refuse what needs more memory; /readyz then answers 503. Any thread.
  [[nodiscard]] bool is_memory_full() const { return memory_.is_full(); }

 private:
  Server(const Config& config, Metrics& metrics, std::unique_ptr<Recorder> recorder,
         std::optional<channel::TokenKey> token_key, std::int64_t now_ns, ClockNs clock,
         const BuildLevels& build_levels, ProcessMemory memory, const LearnHair& learn_hair, ObjectStore* objects);

  // The functions by which the groom store reaches the sessions.
  GroomListener groom_listener();

  // The newest tick that has begun, for Welcome.
  std::atomic<std::uint64_t> tick_{0};
  // Watches the memory of the process.
  MemoryWatch memory_;
  // Members that others refer to come first, so that each member is destroyed before those that it refers to.
  CommandQueue commands_;
  std::unique_ptr<Recorder> recorder_;
  std::optional<GroomCache> groom_cache_;
  std::optional<LevelCache> level_cache_;
  GroomBuilder builder_;
  HairLearner learner_;
  std::optional<ObjectSync> object_sync_;
  GroomStore grooms_;
  SessionContext context_;
  std::optional<RevokedTokensFile> revoked_tokens_file_;
  SessionRegistry sessions_;
  WorkerPool workers_;
  TickClock tick_clock_;
  Scheduler scheduler_;
};

}  // namespace hairnet::server
