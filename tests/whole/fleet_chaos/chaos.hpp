#pragma once

#include <array>
#include <cstdint>
#include <deque>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/random.hpp"
#include "tests/whole/fleet_chaos/chaos_fleet.hpp"
#include "tests/whole/fleet_chaos/figures.hpp"
#include "tests/whole/fleet_chaos/fleet_client.hpp"
#include "tests/whole/owner_check.hpp"

namespace hairnet::whole {

enum class ActionKind : std::uint8_t {
  kill_server,
  drain_server,
  pause_server,
  cut_server,
  kill_etcd,
  pause_etcd,
  cut_etcd,
  etcd_down,
};
inline constexpr std::array<std::string_view, 8> kActionNames{"kill",      "drain",      "pause",    "cut",
                                                              "kill-etcd", "pause-etcd", "cut-etcd", "etcd-down"};

// Whether its target is a server; else it is an etcd.
inline bool is_of_server(ActionKind kind) {
  return kind <= ActionKind::cut_server;
}

// The options of the command line. README.md, "A fleet under chaos", explains the actions.
struct ChaosOptions {
  double duration_s = 1800;
  std::uint64_t seed = 1;
  std::size_t room_count = 10, client_count = 32;
  std::vector<std::string> actions{kActionNames.begin(), kActionNames.end()};
  // What servers do with their rooms while etcd is down: "stop", "go_on", or "both", which is one half of the time
  // each.
  std::string without_etcd = "both";
  std::int64_t lease_s = 5;
  // All etcds are down for so long.
  double outage_s = 20;
  // The longest time between frames where none may stop, and in a drained move.
  double gap_limit_s = 1;
  // The longest time until a killed server's room has an owner.
  double owner_limit_s = 10;
  // The longest time until new rooms are claimed, once etcd is back.
  double claim_limit_s = 5;
  std::string folder;
};

// Real servers, etcds and clients, and a seeded schedule of what is done to them. The table in README.md, "A fleet
// under chaos", says what must hold after each action.
class Chaos final : private FleetClientEvents {
 public:
  explicit Chaos(ChaosOptions options) : options_(std::move(options)), random_(options_.seed, 5) {}
  // False with one line in `error` when this machine cannot run it.
  bool start(std::string& error);
  // Runs until the end. True when nothing failed.
  bool run();

 private:
  struct Action {
    ActionKind kind = ActionKind::kill_server;
    std::size_t target = 0;
    std::string what = {};
    // When the action began, and when its target worked again.
    std::int64_t begin_ns = 0, healed_ns = 0;
    // The clients that the target served when the action began; all clients when the target is an etcd.
    std::vector<std::size_t> clients = {};
    // The rooms that the target owned then.
    std::vector<std::string> rooms = {};
  };
  // A row of the final report: the times until rooms had new owners, the longest gaps of clients, and the times from
  // the healing until they had frames again.
  struct Row {
    std::size_t count = 0, sessions_lost = 0;
    Times owners, gaps, back;
  };
  // A packet with frames. `server_process` is as of ChaosFleet::process_of, `stamp_ns` is the server's time.
  struct Received {
    std::size_t client = 0, server_process = 0;
    std::string room;
    std::int64_t stamp_ns = 0, arrival_ns = 0;
  };
  // A claim is logged before the first frame under it leaves, but the server writes its log in a thread of its own. On
  // a busy machine the line comes after the frame, so a packet waits this long to be checked.
  static constexpr std::int64_t kLogLate_ns = 1'000'000'000;

  void on_frames(std::size_t client, std::size_t server_process, std::int64_t stamp_ns, std::int64_t now_ns) override {
    received_.push_back({client, server_process, clients_[client]->def().room, stamp_ns, now_ns});
    is_lost_[client] = false;
  }
  void on_lost(std::size_t client, std::size_t server, const std::string& error, std::int64_t now_ns) override;
  void on_ended(std::size_t client, const std::string& error, std::int64_t now_ns) override;
  std::size_t process_at(std::size_t server) override { return fleet_->process_of(server); }

  void add_client(const std::string& room, bool is_watcher, bool is_visitor);
  // Lets all clients and checks run for a few milliseconds.
  void pump();
  void pump_for(double seconds);
  // Checks the packets that arrived until that time.
  void check_owners(std::int64_t until_ns);
  void print_progress(std::int64_t now_ns);
  [[nodiscard]] double now_s() const;
  void fault(const std::string& what);
  // Reports the error of a command, unless it is empty.
  void require(const std::string& fault_of_command) {
    if (!fault_of_command.empty()) fault(fault_of_command);
  }

  [[nodiscard]] std::string why_not_settled(std::int64_t now_ns) const;
  void settle(double seconds_max);
  Action next_action();
  void act(Action action);
  void make(Action& action);
  void make_etcd_down(Action& action);
  void judge(const Action& action);
  void switch_policy();
  void end();
  void print_report() const;

  ChaosOptions options_;
  Random random_;
  std::string without_etcd_;
  OwnerCheck owners_;
  std::unique_ptr<ChaosFleet> fleet_;
  std::vector<std::unique_ptr<FleetClient>> clients_;
  // For each client: whether its session was lost and no frame has come since.
  std::vector<bool> is_lost_;
  std::vector<std::string> rooms_;
  // The packets that are not checked yet.
  std::deque<Received> received_;
  // The actions that come next, in random order. Each kind comes once before any comes again.
  std::deque<ActionKind> deck_;
  // The present action, or the last one until the next begins.
  std::optional<Action> action_;
  std::array<Row, kActionNames.size()> rows_{};
  Times claims_after_outage_;
  // The begin of the run, the last line of progress, the end of the last pump(), and the longest time from one pump()
  // to the next one's sockets.
  std::int64_t begin_ns_ = 0, announced_ns_ = 0, turned_ns_ = 0, lag_ns_max_ = 0;
  // The packets at the last line of progress, and the number of rooms that were asked for while etcd was down.
  std::uint64_t packets_announced_ = 0, probe_count_ = 0;
  std::vector<std::string> faults_;
};

}  // namespace hairnet::whole
