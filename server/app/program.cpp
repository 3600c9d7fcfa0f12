#include "server/app/program.hpp"

#include <fmt/format.h>
#include <malloc.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <atomic>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <system_error>
#include <utility>
#include <vector>

#include "schema/files/output_file.hpp"
#include "server/app/agones.hpp"
#include "server/app/fleet.hpp"
#include "server/app/metrics.hpp"
#include "server/app/output.hpp"
#include "server/app/process_memory.hpp"
#include "server/app/room_page.hpp"
#include "server/app/server.hpp"
#include "server/app/server_pages.hpp"
#include "server/app/shared_objects.hpp"
#include "server/app/tick_thread.hpp"
#include "server/files/files.hpp"
#include "server/threading/duty_thread.hpp"
#include "server/transport/io_loop.hpp"
#include "server/transport/listener.hpp"

namespace hairnet::server {
namespace {

// Time-outs, health and the fleet are polled this often. Urgent work, such as results of jobs, is posted to the loop as
// a task.
constexpr std::int64_t kIoPeriod_ns = 20'000'000;
// At a shutdown, sessions have at most this long to be sent to the next servers of their rooms. It is half of drain_s
// where that is less.
constexpr std::int64_t kSendOnMax_ns = 2'000'000'000;
// Exit codes tell scripts a wrong configuration from output that could not be written.
constexpr int kExitUnwritten = 1;
constexpr int kExitBadConfiguration = 2;
// Monitoring needs a few connections; a full public port must not take them away.
constexpr std::size_t kServiceConnectionsMax = 64;
// The reserve exceeds the largest packet with all that the server makes of it, and the memory that ticks need until
// sessions have ended. Its memory is never written, so the system provides no pages for it.
constexpr std::size_t kMemoryReserveBytes = std::size_t{64} << 20;

// Folders that a start made. A check, and a start that is refused, remove them.
class MadeFolders {
 public:
  MadeFolders() = default;
  // The innermost go first; a folder that is not empty stays, since remove() fails for it.
  ~MadeFolders() {
    for (std::error_code ignored; !folders_.empty(); folders_.pop_back())
      std::filesystem::remove(folders_.back(), ignored);
  }
  MadeFolders(const MadeFolders&) = delete;
  MadeFolders& operator=(const MadeFolders&) = delete;

  // Empty when files can be kept in the folder of that setting.
  std::string make(const std::string& folder) { return folder.empty() ? "" : try_folder(folder, folders_); }
  void keep() { folders_.clear(); }

 private:
  std::vector<std::string> folders_;
};

// Tries everything that the server will write. Returns an empty string, or one line that says what fails. A server that
// ran for hours and could then not write would lose a recording; it refuses to start instead.
std::string try_paths(const Config& config, MadeFolders& made) {
  for (const std::string& folder : {config.groom_cache, config.level_cache})
    if (std::string wrong = made.make(folder); !wrong.empty()) return wrong;
  for (const auto& [what, path] : {std::pair("recording", config.record), std::pair("port file", config.port_file)}) {
    const std::string wrong = path.empty() ? "" : try_file(path);
    if (!wrong.empty()) return fmt::format("cannot write the {} {}: {}", what, path, wrong);
  }
  return {};
}

// Writes the port into the file. OutputFile renames a whole file, so a program that waits for it never reads half a
// number.
Result<void> write_port(const std::string& path, std::uint16_t port) {
  Result<OutputFile> file = OutputFile::create(path);
  if (!file) return Refusal(file.error());
  const std::string text = fmt::format("{}\n", port);
  file->write(std::as_bytes(std::span(text)));
  return file->finish();
}

TransportOptions transport_options(const Config& config) {
  TransportOptions options = config.transport;
  options.addresses = {config.bind};
  options.port = config.port;
  AdmissionLimits& admission = options.admission;
  // Twice the sessions, so that a client beyond the limit still gets a Goodbye.
  if (admission.connections_max == 0)
    admission.connections_max = 2 * config.sessions.session_count_max + admission.arrivals_max + admission.http_max;
  return options;
}

// The port of health and metrics. Its few connections have limits of their own, so that no client can fill them.
TransportOptions service_options(const Config& config) {
  TransportOptions options;
  options.addresses = {config.service_bind};
  options.port = config.service_port;
  options.admission.connections_max = kServiceConnectionsMax;
  return options;
}

ProcessMemory process_memory(const Config& config, MemoryReserve& reserve) {
  ProcessMemory memory;
  memory.bytes_max = config.memory_max_mib << 20;
  memory.resident_bytes = resident_bytes;
  memory.allocated_bytes = allocated_bytes;
  memory.give_back = [] { malloc_trim(0); };
  memory.reserve = &reserve;
  return memory;
}

// Ends the server after a signal: the ports close, clients get a Goodbye and their waiting packets, Agones hears of the
// end, then the loop stops.
class Shutdown {
 public:
  // `agones` may be null.
  Shutdown(IoLoop& loop, Server& server, Fleet& fleet, Agones* agones,
           std::vector<std::unique_ptr<Listener>>& listeners, const TransportCounters& counters, double drain_s)
      : loop_(&loop),
        server_(&server),
        fleet_(&fleet),
        agones_(agones),
        listeners_(&listeners),
        counters_(&counters),
        drain_ns_(static_cast<std::int64_t>(drain_s * 1e9)) {}

  void begin(std::int64_t now_ns) {
    // The second signal stops the server at once.
    if (begun_ns_) return loop_->stop();
    begun_ns_ = now_ns;
    // Nobody new may come before those who are here are sent away.
    for (const auto& listener : *listeners_) listener->close();
    // Half of the time at most is for moving rooms to other servers, and the rest for clients to read their last
    // packets.
    server_->drain(std::min(kSendOnMax_ns, drain_ns_ / 2), now_ns);
    fleet_->directory().drain(now_ns);
  }
  void poll(std::int64_t now_ns) {
    if (!begun_ns_) return;
    // A closed session's bytes may still be on their way: the connection exists until its peer has read them.
    const bool drained = server_->session_count() == 0 &&
                         counters_->connections_closed.value() == counters_->connections_accepted.value();
    // The lease ends last: as long as it is valid, no other server takes a room that this one still has.
    if (drained) fleet_->directory().stop(now_ns);
    // A client that does not read its Goodbye cannot hold up the end beyond the drain time.
    if (!(drained && fleet_->directory().is_stopped()) && now_ns - *begun_ns_ <= drain_ns_) return;
    if (!agones_ || agones_->has_shut_down(now_ns)) loop_->stop();
  }

 private:
  IoLoop* loop_;
  Server* server_;
  Fleet* fleet_;
  Agones* agones_;
  std::vector<std::unique_ptr<Listener>>* listeners_;
  const TransportCounters* counters_;
  std::int64_t drain_ns_;
  // The first signal came at this time.
  std::optional<std::int64_t> begun_ns_;
};

// The threads beside the I/O thread. Ends them in the direction of the data: tick, builder, learner and
// objects, recorder.
class Threads {
 public:
  Threads(Server& server, Metrics& metrics, IoLoop& loop) : server_(&server) {
    // Each thread begins after those that it gives data to, so nobody wakes a thread that does not exist.
    recorder_.emplace([&server] { return server.poll_recorder(); }, DutyThread::Priority::normal);
    if (server.recorder()) server.recorder()->on_put = [this] { recorder_->wake(); };
    // Results of jobs wake the I/O thread at once, without waiting for its period.
    const auto poll_io = [&server, &loop] { loop.post([&server] { server.poll_io(channel::monotonic_ns()); }); };
    server.builder().on_result = server.learner().on_result = poll_io;
    server.builder().on_job = [this] { builder_->wake(); };
    builder_.emplace([&server] { return server.poll_builder(); }, DutyThread::Priority::low);
    server.learner().on_job = [this] { learner_->wake(); };
    learner_.emplace([&server] { return server.poll_learner(); }, DutyThread::Priority::low);
    if (ObjectSync* objects = server.object_sync()) {
      objects->on_result = poll_io;
      objects->on_job = [this] { objects_->wake(); };
      objects_.emplace([&server] { return server.poll_objects(); }, DutyThread::Priority::low);
    }
    tick_.emplace(server, metrics.tick, [this, &server, &loop] {
      // A busy I/O thread flushes once for several ticks.
      if (flush_posted_.exchange(true)) return;
      loop.post([this, &server] {
        flush_posted_ = false;
        server.flush(channel::monotonic_ns());
      });
    });
  }
  ~Threads() {
    // The tick ends first, as it feeds the recorder. Jobs are cancelled, or a long build would hold up the end.
    tick_.reset();
    server_->builder().cancel();
    server_->learner().cancel();
    if (server_->object_sync()) server_->object_sync()->cancel();
    builder_.reset();
    learner_.reset();
    objects_.reset();
    recorder_.reset();
  }

 private:
  Server* server_;
  // A flush is posted to the loop and has not begun.
  std::atomic<bool> flush_posted_{false};
  std::optional<DutyThread> recorder_, builder_, learner_, objects_;
  std::optional<TickThread> tick_;
};

// Logs all counters once in `interval_s`, at log level debug only.
void log_counters(const Metrics& metrics, double interval_s, IoLoop& loop) {
  if (!spdlog::should_log(spdlog::level::debug)) return;
  loop.every(static_cast<std::int64_t>(interval_s * 1e9),
             [&metrics] { spdlog::debug("event=counters {}", to_text(metrics, '=', ' ')); });
}

}  // namespace

// The order of this function is that of the references between its objects: each uses those made before it, and
// destructors run in the opposite order.
int run_program(const Config& given, bool check_only) {
  Config config = given;
  Metrics metrics;
  Output output(config.log_level, metrics.program_counters);
  const auto refuse = [&output](const std::string& error) {
    output.complain(fmt::format("hairnet-server: {}\n", error));
    return kExitBadConfiguration;
  };
  // Declared before all that can refuse the start, so its destructor removes the folders in each of these cases.
  MadeFolders made_folders;
  if (const std::string wrong = try_paths(config, made_folders); !wrong.empty()) return refuse(wrong);
  // A check does not write the recording; try_paths() has tried the file.
  if (check_only) config.record.clear();
  // The loop outlives the sessions, which own its sockets.
  IoLoop loop;
  // The calling thread becomes its owner, as it is the I/O thread, which frees memory.
  MemoryReserve reserve(kMemoryReserveBytes);
  const auto objects = SharedObjects::create(config.object_store, metrics.objects, channel::monotonic_ns);
  if (!objects) return refuse(objects.error());
  auto created =
      Server::create(config, metrics, channel::monotonic_ns(), channel::monotonic_ns, build_levels_in_child_process,
                     process_memory(config, reserve), learn_hair_in_process, *objects ? &(*objects)->store() : nullptr);
  if (!created) return refuse(created.error());
  Server& server = **created;
  metrics.program.start_time_seconds.set(static_cast<double>(std::time(nullptr)));
  Health health;
  std::unique_ptr<Fleet> fleet;
  // health_now is called on the I/O thread; from the other threads it reads only atomics.
  const auto health_now = [&health, &metrics, &server, &fleet] {
    Health now = health;
    now.memory_full = server.is_memory_full();
    now.last_tick_ns = metrics.tick.gauges.last_tick_ns.load(std::memory_order_relaxed);
    now.now_ns = channel::monotonic_ns();
    now.in_fleet = fleet && fleet->is_joined(now.now_ns);
    return now;
  };
  const bool has_service_port = config.service_port != 0;
  FleetPages fleet_now;
  // Names of rooms are not for everyone, so only a service port shows them.
  if (has_service_port) fleet_now = {[&fleet] { return fleet->json(); }, [&fleet] { return fleet->html(); }};
  const auto find = [&fleet](const std::string& room) { return fleet->find_room(room, channel::monotonic_ns()); };
  RoomPage service_room(metrics.fleet, {find});
  // Without tokens anyone may enter a room, and so learn where it is.
  RoomPage public_room(metrics.fleet, {find, [&server](std::string_view token, const std::string& room) {
                                         return server.why_refused(token, room);
                                       }});
  ServerPages pages(metrics, health_now, std::move(fleet_now), has_service_port ? service_room : public_room);
  // A check may run beside the server that uses the port.
  const PortInUse in_use = check_only ? PortInUse::passed_over : PortInUse::refused;
  auto listener = Listener::create(
      loop, transport_options(config), metrics.transport,
      [&server](std::shared_ptr<Connection> connection, std::int64_t now_ns) {
        return server.open(std::move(connection), now_ns);
      },
      has_service_port ? static_cast<HttpService*>(&public_room) : &pages, in_use);
  if (!listener) return refuse(listener.error());
  const std::uint16_t port = (*listener)->port();
  std::vector<std::unique_ptr<Listener>> listeners;
  listeners.push_back(std::move(*listener));
  if (has_service_port) {
    auto service = Listener::create(loop, service_options(config), metrics.transport, nullptr, &pages,
                                    config.service_port == port ? PortInUse::refused : in_use);
    if (!service) return refuse(service.error());
    listeners.push_back(std::move(*service));
  }
  // The fleet comes after the port, whose number it tells to other servers.
  auto joined = Fleet::create(config, port, loop, metrics);
  if (!joined) return refuse(joined.error());
  fleet = std::move(*joined);
  fleet->on_address = [&listeners](const ServerAddress& address) { listeners.front()->set_public_port(address.port); };
  if (fleet->is_shared()) {
    fleet->on_address(fleet_address(config.fleet, port));
    server.join_fleet(fleet->directory());
    fleet->on_event = [&server](const FleetEvent& event, std::int64_t now_ns) {
      if (event.kind == FleetEvent::Kind::room_claimed) server.on_room_claimed(event.room, event.kept, now_ns);
      if (event.kind == FleetEvent::Kind::grooms_passed_on) server.prepare(event.grooms, now_ns);
      if (event.kind == FleetEvent::Kind::room_lost || event.kind == FleetEvent::Kind::room_handed_over)
        server.on_room_lost(event.room, now_ns);
    };
  }
  auto made = Agones::create(config, std::getenv(agones::kPortVariable), loop, metrics);
  if (!made) return refuse(made.error());
  const std::unique_ptr<Agones> agones = std::move(*made);
  if (check_only) {
    const std::string text =
        fmt::format("# configuration is valid: {}:{}, {}\n{}", given.bind, given.port, summary(given), to_text(given));
    const bool is_written = std::fputs(text.c_str(), stdout) >= 0 && std::fflush(stdout) == 0;
    return is_written ? 0 : kExitUnwritten;
  }
  if (!config.port_file.empty()) {
    // The file appears when the port is open: programs wait for it to connect.
    if (const Result<void> written = write_port(config.port_file, port); !written)
      return refuse("cannot write the port file " + config.port_file + ": " + written.error());
  }
  // Nothing refuses the start any more.
  made_folders.keep();

  Shutdown shutdown(loop, server, *fleet, agones.get(), listeners, metrics.transport, config.drain_s);
  loop.on_terminate([&shutdown, &health] {
    health.draining = true;
    shutdown.begin(channel::monotonic_ns());
  });
  const auto poll_all = [&server, &fleet, &agones, &health_now, &shutdown] {
    const std::int64_t now_ns = channel::monotonic_ns();
    // The fleet comes first: sessions that wait for a room then learn the directory's news in the same turn.
    fleet->poll(server.takes_clients(), server.largest_room(), now_ns);
    server.poll_io(now_ns);
    server.set_overloaded_room(fleet->overloaded_room());
    const auto characters = [&server](const std::string& room) { return server.character_count(room); };
    if (const auto move = fleet->choose_move(characters, now_ns)) server.hand_over(move->room, move->to, now_ns);
    if (agones) agones->poll(health_now(), *fleet, now_ns);
    shutdown.poll(now_ns);
  };
  loop.every(kIoPeriod_ns, poll_all);
  bool is_posted = false;
  fleet->directory().on_news = [&loop, &poll_all, &is_posted] {
    // Several pieces of news from one answer cause one turn.
    if (std::exchange(is_posted, true)) return;
    loop.post([&poll_all, &is_posted] {
      is_posted = false;
      poll_all();
    });
  };
  log_counters(metrics, config.counters_interval_s, loop);
  // The port has listened since Listener::create. Connections that came since then are accepted when the loop runs.
  health.accepting = true;
  output.print(fmt::format("hairnet-server listening on {}:{}, {}\n", config.bind, port, summary(config)));
  {
    // The threads end before their parts do, at the end of this block.
    const Threads threads(server, metrics, loop);
    loop.run();
  }
  output.print(fmt::format("hairnet-server stopped\n{}", to_text(metrics, ' ', '\n')));
  return 0;
}

}  // namespace hairnet::server
