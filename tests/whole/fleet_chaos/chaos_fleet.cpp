#include "tests/whole/fleet_chaos/chaos_fleet.hpp"

#include <fmt/format.h>
#include <signal.h>
#include <unistd.h>

#include <chrono>
#include <ctime>
#include <filesystem>
#include <fstream>

#include "schema/channel/monotonic_clock.hpp"
#include "tests/whole/loopback.hpp"

namespace hairnet::whole {
namespace {

constexpr const char* kEtcd = "/usr/bin/etcd";
// etcd needs some seconds to elect a leader, and more on a busy machine. A server that drains ends within some seconds,
// too.
constexpr double kStartWait_s = 60, kStopWait_s = 30;

// The value of a field of a log line; without its quotes.
std::string field(const std::string& line, const std::string& name) {
  const std::size_t at = line.find(" " + name + "=");
  if (at == std::string::npos) return {};
  std::size_t begin = at + name.size() + 2;
  if (begin < line.size() && line[begin] == '"') return line.substr(begin + 1, line.find('"', begin + 1) - begin - 1);
  return line.substr(begin, line.find(' ', begin) - begin);
}

// Reads the time in "time=2026-01-31T12:00:00.000Z ...", and returns it on CLOCK_MONOTONIC.
std::optional<std::int64_t> time_of(const std::string& line) {
  std::tm date{};
  const char* rest = ::strptime(line.c_str(), "time=%Y-%m-%dT%H:%M:%S.", &date);
  if (!rest) return std::nullopt;
  const std::int64_t wall_ns =
      static_cast<std::int64_t>(::timegm(&date)) * 1'000'000'000 + std::atoi(rest) * 1'000'000LL;
  timespec wall{};
  ::clock_gettime(CLOCK_REALTIME, &wall);
  const std::int64_t offset_ns =
      static_cast<std::int64_t>(wall.tv_sec) * 1'000'000'000 + wall.tv_nsec - channel::monotonic_ns();
  return wall_ns - offset_ns;
}

std::vector<std::size_t> all_etcds() {
  std::vector<std::size_t> all;
  for (std::size_t n = 0; n < kEtcdCount; ++n) all.push_back(n);
  return all;
}

}  // namespace

Result<std::unique_ptr<ChaosFleet>> ChaosFleet::start(std::string folder, std::int64_t lease_s,
                                                      const std::string& without_etcd, OwnerCheck& owners) {
  if (::access(kEtcd, X_OK) != 0) return Refusal(fmt::format("there is no {}; deploy/setup installs it", kEtcd));
  std::unique_ptr<ChaosFleet> fleet(new ChaosFleet(folder, lease_s, without_etcd, owners));
  Result<std::unique_ptr<Machines>> machines = Machines::create(kEtcdCount + kServerCount, folder);
  if (!machines) return Refusal(machines.error());
  fleet->machines_ = std::move(*machines);
  fleet->etcds_.resize(kEtcdCount);
  fleet->etcd_starts_.resize(kEtcdCount);
  fleet->servers_.resize(kServerCount);
  for (std::size_t n = 0; n < kEtcdCount; ++n) fleet->start_etcd(n);
  fleet->health_ = std::jthread([raw = fleet.get()](const std::stop_token& stop) { raw->watch_health(stop); });
  const auto deadline = std::chrono::steady_clock::now() + std::chrono::duration<double>(kStartWait_s);
  while (fleet->healthy_since_ns_ == 0) {
    if (std::chrono::steady_clock::now() > deadline) return Refusal("etcd does not answer; see " + folder);
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
  for (std::size_t n = 0; n < kServerCount; ++n) fleet->start_server(n);
  return fleet;
}

ChaosFleet::~ChaosFleet() {
  for (const Server& server : servers_)
    if (server.process) server.process->send(SIGCONT);
}

void ChaosFleet::start_etcd(std::size_t etcd) {
  std::string peers;
  for (std::size_t n = 0; n < kEtcdCount; ++n)
    peers += fmt::format("{}etcd{}=http://{}:2380", n ? "," : "", n, machines_->address(n));
  const std::string client = fmt::format("http://{}:2379", machines_->address(etcd)),
                    peer = fmt::format("http://{}:2380", machines_->address(etcd));
  etcds_[etcd] = std::make_unique<Process>(
      machines_->on(etcd, {kEtcd, "--name", fmt::format("etcd{}", etcd), "--data-dir",
                           fmt::format("{}/etcd{}.data", folder_, etcd), "--listen-client-urls", client,
                           "--advertise-client-urls", client, "--listen-peer-urls", peer,
                           "--initial-advertise-peer-urls", peer, "--initial-cluster", peers, "--pre-vote"}),
      fmt::format("{}/etcd{}.{}", folder_, etcd, etcd_starts_[etcd]));
  ++etcd_starts_[etcd];
}

void ChaosFleet::start_server(std::size_t n) {
  Server& server = servers_[n];
  if (server.process) {
    read_log(server);
    // Numbers of processes count on by kServerCount, so that each process has its own, and server_of() finds its
    // server.
    server.life += kServerCount;
  } else {
    server.life = n;
  }
  server.log = fmt::format("{}/server{}.{}", folder_, n, server.life / kServerCount);
  server.read_bytes = 0;
  std::string endpoints;
  for (std::size_t e = 0; e < kEtcdCount; ++e)
    endpoints += fmt::format("{}http://{}:2379", e ? " " : "", machines_->address(e));
  const std::vector<std::string> command{std::string(HAIRNET_BIN_DIR) + "/hairnet-server",
                                         "--bind",
                                         "0.0.0.0",
                                         "--port",
                                         std::to_string(kServerPort),
                                         "--etcd",
                                         endpoints,
                                         "--fleet-address",
                                         address(n),
                                         "--fleet-lease",
                                         std::to_string(lease_s_),
                                         "--without-etcd",
                                         without_etcd_,
                                         "--level-cache",
                                         folder_ + "/levels",
                                         "--groom-cache",
                                         folder_ + "/grooms",
                                         "--workers",
                                         "1",
                                         "--learn-hair",
                                         "never",
                                         "--log-level",
                                         "info"};
  server.process = std::make_unique<Process>(machines_->on(kEtcdCount + n, command), server.log);
}

std::size_t ChaosFleet::server_at(const std::string& wanted) const {
  for (std::size_t n = 0; n < kServerCount; ++n)
    if (address(n) == wanted) return n;
  return kServerCount;
}

std::string ChaosFleet::cut_server(std::size_t server, CutDirection direction) {
  return machines_->cut(kEtcdCount + server, all_etcds(), direction);
}

std::string ChaosFleet::cut_etcd(std::size_t etcd) {
  std::vector<std::size_t> others = all_etcds();
  others.erase(others.begin() + static_cast<std::ptrdiff_t>(etcd));
  return machines_->cut(etcd, others, CutDirection::both);
}

void ChaosFleet::read_logs() {
  for (Server& server : servers_) read_log(server);
}

void ChaosFleet::read_log(Server& server) {
  std::error_code ignored;
  const std::string path = server.log + ".err";
  if (std::filesystem::file_size(path, ignored) <= server.read_bytes || ignored) return;
  std::ifstream file(path, std::ios::binary);
  file.seekg(static_cast<std::streamoff>(server.read_bytes));
  for (std::string line; std::getline(file, line) && !file.eof();) {
    server.read_bytes += line.size() + 1;
    take_line(server, line);
  }
}

void ChaosFleet::take_line(const Server& server, const std::string& line) {
  const std::string event = field(line, "event");
  ++events_[event];
  if (event != "room_claimed") return;
  if (const auto at_ns = time_of(line))
    owners_->claimed(server.life, field(line, "room"), std::atoll(field(line, "claim").c_str()), *at_ns);
}

void ChaosFleet::watch_health(const std::stop_token& stop) {
  while (!stop.stop_requested()) {
    std::size_t healthy = 0;
    for (std::size_t n = 0; n < kEtcdCount; ++n)
      healthy += get(machines_->address(n), 2379, "/health").find("\"true\"") != std::string::npos;
    // etcd works as long as more than half of its members do.
    if (2 * healthy <= kEtcdCount)
      healthy_since_ns_ = 0;
    else if (healthy_since_ns_ == 0)
      healthy_since_ns_ = channel::monotonic_ns();
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
  }
}

std::vector<std::string> ChaosFleet::stop() {
  std::vector<std::string> faults;
  for (const Server& server : servers_) server.process->send(SIGTERM);
  for (Server& server : servers_)
    if (const int code = server.process->wait(kStopWait_s); code != 0)
      faults.push_back(
          fmt::format("server process {} ended with {} after SIGTERM; see {}.err", server.life, code, server.log));
  return faults;
}

}  // namespace hairnet::whole
