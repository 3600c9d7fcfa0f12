#include "server/app/server.hpp"

#include <chrono>
#include <utility>

#include "core/assert.hpp"
#include "core/learnt/pose_inputs.hpp"
#include "server/files/files.hpp"
#include "server/session/verify_token.hpp"

namespace hairnet::server {
namespace {

// A longer file cannot be one of `hairnet-token key`, and is not read.
constexpr std::size_t kTokenKeyFileBytesMax = 4096;

// The only place where settings become those of the tick: the tick's folder knows no Config.
SchedulerDef scheduler_def(const Config& config, WorkerPool& workers, ClockNs clock) {
  SchedulerDef def;
  def.tick_rate_hz = config.tick_rate_hz;
  def.pose_delay_ns = static_cast<std::int64_t>(config.pose_delay_ms * 1e6);
  def.world.substep_count = config.substeps;
  def.world.character_count_max = static_cast<std::uint32_t>(config.sessions.character_count_max);
  def.world.iterations = config.iterations;
  def.wind = config.wind;
  def.publish.packet_bytes_max = config.sessions.frame_packet_bytes_max;
  def.room_grace_ns = config.room_grace_ns;
  def.room_count_max = config.sessions.room_count_max;
  def.state_bytes_max = config.state_bytes_max;
  def.world.now_ns = clock;
  def.levels.tick_share = config.tick_budget;
  def.levels.workers = static_cast<int>(config.workers);
  def.world.parallel_for = [&workers](std::size_t count, const std::function<void(std::size_t)>& body) {
    workers.parallel_for(count, body);
  };
  return def;
}

// The connection of a cache to the object store, or null without a store.
template <class Cache>
std::unique_ptr<CacheObjects> make_objects(ObjectStore* store, ObjectCounters& counters) {
  return store ? std::make_unique<CacheObjects>(Cache::objects_def(counters), *store, counters) : nullptr;
}

// These two make no cache when the operator has named no folder.
std::optional<LevelCache> make_level_cache(const Config& config, Metrics& metrics, ObjectStore* objects) {
  if (config.level_cache.empty()) return std::nullopt;
  return std::optional<LevelCache>(std::in_place, config.level_cache, config.level_cache_mib << 20, metrics.level_cache,
                                   make_objects<LevelCache>(objects, metrics.objects));
}

std::optional<GroomCache> make_groom_cache(const Config& config, Metrics& metrics, ObjectStore* objects) {
  if (config.groom_cache.empty()) return std::nullopt;
  return std::optional<GroomCache>(std::in_place, config.groom_cache, config.groom_cache_mib << 20, metrics.groom_cache,
                                   make_objects<GroomCache>(objects, metrics.objects));
}

GroomBuilderDef builder_def(const Config& config, std::optional<LevelCache>& levels, std::optional<GroomCache>& grooms,
                            ClockNs clock, const BuildLevels& build_levels) {
  GroomBuilderDef def;
  def.build.groom = config.grooms.groom;
  def.build.thread_count = config.build_threads;
  def.build.memory_bytes_max = config.grooms.build_memory_bytes_max;
  def.build.ns_max = config.grooms.build_ns_max;
  def.build_levels = build_levels;
  def.bytes_max = config.grooms.groom_bytes_max;
  def.levels = levels ? &*levels : nullptr;
  def.grooms = grooms ? &*grooms : nullptr;
  def.now_ns = clock;
  return def;
}

Result<channel::TokenKey> read_token_key(const std::string& path) {
  const Result<std::string> text = read_text_file(path, kTokenKeyFileBytesMax);
  if (!text) return Refusal("token key file " + path + ": " + text.error());
  channel::TokenKey key = channel::TokenKey::parse(*text);
  // A file that can be read and has no key must not start a server that lets everyone in.
  if (key.empty()) return Refusal("token key file " + path + ": was not made by hairnet-token key");
  return key;
}

std::int64_t unix_time_s() {
  return std::chrono::duration_cast<std::chrono::seconds>(std::chrono::system_clock::now().time_since_epoch()).count();
}

}  // namespace

Result<std::unique_ptr<Server>> Server::create(const Config& config, Metrics& metrics, std::int64_t now_ns,
                                               ClockNs clock, const BuildLevels& build_levels, ProcessMemory memory,
                                               const LearnHair& learn_hair, ObjectStore* objects) {
  // Tests make servers without a command line, so the limits are checked here again.
  if (std::string wrong = validate(config); !wrong.empty()) return Refusal(std::move(wrong));
  std::unique_ptr<Recorder> recorder;
  if (!config.record.empty()) {
    Result<std::unique_ptr<Recorder>> created = Recorder::create(config.record, metrics.tick);
    if (!created) return Refusal(created.error());
    recorder = std::move(*created);
  }
  std::optional<channel::TokenKey> token_key;
  if (!config.token_key_file.empty()) {
    Result<channel::TokenKey> read = read_token_key(config.token_key_file);
    if (!read) return Refusal(read.error());
    token_key.emplace(std::move(*read));
  }
  std::unique_ptr<Server> server(new Server(config, metrics, std::move(recorder), std::move(token_key), now_ns, clock,
                                            build_levels, std::move(memory), learn_hair, objects));
  if (!config.token_revoked_file.empty()) {
    RevokedTokensFile& file = server->revoked_tokens_file_.emplace(config.token_revoked_file);
    // The first read must succeed: with no list yet, every revoked token would be let in.
    if (const std::string error = file.poll(server->context_.revoked_tokens, now_ns); !error.empty())
      return Refusal("file of revoked tokens " + config.token_revoked_file + ": " + error);
  }
  return server;
}

Server::Server(const Config& config, Metrics& metrics, std::unique_ptr<Recorder> recorder,
               std::optional<channel::TokenKey> token_key, std::int64_t now_ns, ClockNs clock,
               const BuildLevels& build_levels, ProcessMemory memory, const LearnHair& learn_hair, ObjectStore* objects)
    : memory_(std::move(memory), metrics.program, metrics.program_counters),
      commands_(config.command_weight_max),
      recorder_(std::move(recorder)),
      groom_cache_(make_groom_cache(config, metrics, objects)),
      level_cache_(make_level_cache(config, metrics, objects)),
      builder_(builder_def(config, level_cache_, groom_cache_, clock, build_levels)),
      learner_({.groom = config.grooms.groom, .learn = learn_hair, .now_ns = clock}),
      grooms_(config.grooms, builder_, commands_, metrics.groom, groom_listener()),
      context_{config.sessions,
               metrics.session,
               commands_,
               grooms_,
               config.tick_rate_hz,
               config.grooms.groom_bytes_max,
               tick_,
               static_cast<std::int64_t>(config.pose_delay_ms * 1e6),
               config.room_grace_ns,
               std::move(token_key),
               unix_time_s},
      sessions_(context_),
      workers_(config.workers),
      tick_clock_(config.tick_rate_hz, config.ticks_behind_max, now_ns),
      scheduler_(scheduler_def(config, workers_, clock), commands_, metrics.room, metrics.tick, recorder_.get()) {
  // Learning takes a core for a while, so it begins where hair is coarser than its owners asked for, and at the tick
  // rate that networks are made for.
  if (is_learnt_tick(1.0 / config.tick_rate_hz))
    grooms_.learn_with(learner_, [&gauge = metrics.tick.gauges.characters_below_wanted] { return gauge.value() > 0; });
  if (objects) {
    object_sync_.emplace(groom_cache_ ? &*groom_cache_ : nullptr, level_cache_ ? &*level_cache_ : nullptr, *objects,
                         metrics.objects);
    grooms_.find_in(*object_sync_);
  }
  context_.is_memory_full = [this] { return memory_.is_full(); };
}

GroomListener Server::groom_listener() {
  GroomListener listener;
  // A session may end while its groom is being built, so it is looked up by number each time.
  listener.send = [this](SessionId id, const wire::Message& message, std::int64_t now_ns) {
    if (Session* session = sessions_.find(id)) session->send(message, now_ns);
  };
  listener.deliver = [this](SessionId id, const wire::GroomHash& groom, GroomStore::Bytes bytes, std::int64_t now_ns) {
    if (Session* session = sessions_.find(id)) session->on_groom_read(groom, std::move(bytes), now_ns);
  };
  listener.revoke = [this](SessionId id, const wire::GroomHash& groom, std::int64_t) {
    if (Session* session = sessions_.find(id)) session->revoke_groom(groom);
  };
  return listener;
}

std::string Server::why_refused(std::string_view token, const std::string& room) const {
  std::optional<channel::TokenClaims> claims;
  // An observer needs the least rights; who may not even observe gets no address.
  return verify_token(context_, token, room, wire::Role::observer, claims).detail;
}

RoomLoad Server::largest_room() const {
  std::string room = context_.rooms.largest();
  const std::size_t characters = character_count(room);
  return {.room = std::move(room), .room_characters = characters, .characters = context_.character_count};
}

PacketSink* Server::open(std::shared_ptr<Connection> connection, std::int64_t now_ns) {
  return sessions_.open(std::move(connection), now_ns);
}

void Server::poll_io(std::int64_t now_ns) {
  if (revoked_tokens_file_) revoked_tokens_file_->poll(context_.revoked_tokens, now_ns);
  // Memory is looked at first, so that what follows already refuses what needs more of it.
  memory_.poll(now_ns);
  // Each poll frees one unused groom or one upload, and ends at most one session: the memory is looked at again before
  // the next.
  if (memory_.is_full()) {
    grooms_.free_memory(now_ns);
    sessions_.free_memory(now_ns);
  }
  grooms_.poll(now_ns);
  sessions_.poll(now_ns);
}

bool Server::poll_tick(std::int64_t now_ns) {
  const std::optional<TickClock::Tick> due = tick_clock_.take(now_ns);
  if (!due) return false;
  HAIRNET_ASSERT(due->tick == 0 || due->tick > tick_.load(std::memory_order_relaxed));
  // The I/O thread only reads the number, for Welcome; nothing else depends on it.
  tick_.store(due->tick, std::memory_order_relaxed);
  scheduler_.run_tick(*due, now_ns);
  return true;
}

void Server::poll(std::int64_t now_ns) {
  poll_io(now_ns);
  poll_builder();
  poll_learner();
  poll_objects();
  while (poll_tick(now_ns)) {
  }
  flush(now_ns);
  poll_recorder();
}

}  // namespace hairnet::server
