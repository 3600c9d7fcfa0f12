#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>

#include "core/result.hpp"
#include "server/app/config.hpp"
#include "server/app/memory_watch.hpp"
#include "server/app/metrics.hpp"
#include "server/app/revoked_tokens_file.hpp"
#include "server/grooms/groom_store.hpp"
#include "server/session/session_registry.hpp"
#include "server/threading/worker_pool.hpp"
#include "server/tick/recorder.hpp"
#include "server/tick/scheduler.hpp"

namespace hairnet::server {

// The whole server without sockets, duty threads and a clock. It has five duties, each for one thread: I/O
// (sessions and groom store), tick, builder, learner, recorder. Duties exchange data through bounded queues only, so
// poll() can also run all of them in turn on one thread. The server owns the helper threads of the tick's and the
// build's loops, and reads the wall clock to check when tokens expire.
class Server {
 public:
  // `metrics` must outlive the server. Ticks are counted from `now_ns`. `clock`, which any thread may call, measures
  // the duration of work; without one nothing is measured and every character is stepped at the level that its owner
  // asked for. `build_levels` builds the grooms, on the builder thread. `memory` may be empty. `learn_hair` runs on the
  // learner thread.
  static Result<std::unique_ptr<Server>> create(const Config& config, Metrics& metrics, std::int64_t now_ns,
                                                ClockNs clock = nullptr,
                                                const BuildLevels& build_levels = build_levels_here,
                                                ProcessMemory memory = {},
                                                const LearnHair& learn_hair = learn_hair_here);

  // I/O thread.
  PacketSink* open(std::shared_ptr<Connection> connection, std::int64_t now_ns);
  void poll_io(std::int64_t now_ns);
  void flush(std::int64_t now_ns) { sessions_.flush(now_ns); }
  void drain(std::int64_t now_ns) { sessions_.drain(now_ns); }
  [[nodiscard]] std::size_t session_count() const { return sessions_.count(); }
  // Tick thread. True when a tick has run: there may be something to flush.
  bool poll_tick(std::int64_t now_ns);
  [[nodiscard]] std::int64_t next_tick_ns() const { return tick_clock_.next_due_ns(); }
  // Builder thread.
  bool poll_builder() { return builder_.poll(); }
  // Learner thread.
  bool poll_learner() { return learner_.poll(); }
  // Recorder thread.
  bool poll_recorder() { return recorder_ && recorder_->poll(); }

  // All duties in turn, for tests.
  void poll(std::int64_t now_ns);

  [[nodiscard]] GroomBuilder& builder() { return builder_; }
  [[nodiscard]] HairLearner& learner() { return learner_; }
  [[nodiscard]] Recorder* recorder() { return recorder_.get(); }
  // For tests that run all duties on one thread.
  [[nodiscard]] const Scheduler& scheduler() const { return scheduler_; }
  [[nodiscard]] const SessionRegistry& sessions() const { return sessions_; }
  [[nodiscard]] const SessionContext& context() const { return context_; }
  [[nodiscard]] const GroomStore& grooms() const { return grooms_; }
  // /readyz asks. Any thread.
  [[nodiscard]] bool is_memory_full() const { return memory_.is_full(); }

 private:
  Server(const Config& config, Metrics& metrics, std::unique_ptr<Recorder> recorder,
         std::optional<channel::TokenKey> token_key, std::int64_t now_ns, ClockNs clock,
         const BuildLevels& build_levels, ProcessMemory memory, const LearnHair& learn_hair);

  GroomListener groom_listener();

  std::atomic<std::uint64_t> tick_{0};  // the newest tick that has begun, for Welcome
  MemoryWatch memory_;
  CommandQueue commands_;
  std::unique_ptr<Recorder> recorder_;
  std::optional<GroomCache> groom_cache_;
  std::optional<LevelCache> level_cache_;
  GroomBuilder builder_;
  HairLearner learner_;
  GroomStore grooms_;
  SessionContext context_;
  std::optional<RevokedTokensFile> revoked_tokens_file_;
  SessionRegistry sessions_;
  WorkerPool workers_;
  TickClock tick_clock_;
  Scheduler scheduler_;
};

}  // namespace hairnet::server
