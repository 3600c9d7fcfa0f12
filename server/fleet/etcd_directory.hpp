#pragma once

#include <map>
#include <set>

#include "core/random.hpp"
#include "server/fleet/directory.hpp"
#include "server/fleet/etcd_api.hpp"
#include "server/fleet/etcd_transport.hpp"
#include "server/fleet/fleet_counters.hpp"
#include "server/fleet/fleet_view.hpp"

namespace hairnet::server {

// What a server's rooms do when the lease runs out because no endpoint of etcd answers.
enum class WithoutEtcd : std::uint8_t {
  stop,   // frames stop until etcd answers: never two owners
  go_on,  // rooms go on: never two owners if etcd is out of reach for all servers, else two until the server hears it
};

struct EtcdDirectoryDef {
  // Is random, new at each start, and never zero.
  std::uint64_t server_id = 0;
  // Is told later when it has no host.
  ServerAddress address;
  std::string fleet = "default";
  std::size_t endpoint_count = 1;
  // etcd keeps a server's rooms for this long without hearing it.
  std::int64_t lease_s = 9;
  WithoutEtcd without_etcd = WithoutEtcd::stop;
  // Bounds the rooms of this server.
  std::size_t rooms_max = 4096;
  // Seeds the jitter between tries.
  std::uint64_t seed = 0;
};

// The part of a lease's time that is not used: for clocks of different speed, and for time between a check of the fence
// and the frame that leaves.
[[nodiscard]] std::int64_t lease_margin_ns(std::int64_t lease_ns);

// A directory in etcd. This server has one lease; its keys in etcd vanish with it. README.md has the rules and why two
// servers never own a room at a time. `etcd_lease`, `etcd_rooms`, `etcd_kept` and `etcd_view` are its parts.
class EtcdDirectory final : public Directory, public EtcdSink {
 public:
  // `transport` and `counters` must outlive the directory.
  EtcdDirectory(const EtcdDirectoryDef& def, EtcdTransport& transport, FleetCounters& counters);

  // Where clients reach this server. Until it is known the directory does not join the fleet.
  void set_address(const ServerAddress& address) { status_.address = address; }

  [[nodiscard]] Placement where(std::string_view room, std::int64_t now_ns) const override;
  [[nodiscard]] bool holds(std::string_view room, std::int64_t now_ns) const override;
  bool claim(std::string_view room, std::int64_t now_ns) override;
  void release(std::string_view room, std::int64_t now_ns) override;
  void hand_over(std::string_view room, std::uint64_t to, std::int64_t now_ns) override;
  void keep(std::string_view room, std::string text, std::int64_t now_ns) override;
  void look_again(std::int64_t now_ns) override;
  void tell(const ServerLoad& load) override;
  void drain(std::int64_t now_ns) override;
  void pass_on(std::vector<ContentHash> grooms) override;
  void stop(std::int64_t now_ns) override;
  [[nodiscard]] bool is_stopped() const override { return is_stopping_ && lease_ == 0 && calls_.empty(); }
  void poll(std::int64_t now_ns) override;
  std::vector<FleetEvent> take_events() override;
  [[nodiscard]] std::uint64_t server_id() const override { return status_.id; }
  [[nodiscard]] bool is_reachable() const override { return failures_ < def_.endpoint_count; }
  [[nodiscard]] std::vector<ServerStatus> servers() const override;
  [[nodiscard]] std::vector<RoomOwner> rooms() const override;
  [[nodiscard]] std::vector<std::string> own_rooms() const override;

  void on_answer(std::uint64_t call, int status, std::string_view body, std::int64_t now_ns) override;
  void on_line(std::uint64_t call, std::string_view line, std::int64_t now_ns) override;
  void on_fault(std::uint64_t call, EtcdFault fault, std::int64_t now_ns) override;

  // For tests: calls under way, and rooms that are claimed, owned or being released.
  [[nodiscard]] std::size_t call_count() const { return calls_.size(); }
  [[nodiscard]] std::size_t room_count() const { return rooms_.size(); }

 private:
  static constexpr std::size_t kCallsMax = 32;
  enum class Purpose : std::uint8_t {
    grant,
    keep_alive,
    ask_lease,
    revoke,
    publish,
    list,
    watch,
    claim,
    release,
    keep,
    keep_grant,
    keep_renewal
  };
  struct Call {
    Purpose purpose = Purpose::grant;
    std::size_t endpoint = 0;
    // Is generation_ when the call was sent.
    std::uint64_t generation = 0;
    std::int64_t sent_ns = 0, deadline_ns = 0;
    // Is lease_ when the call was sent.
    std::int64_t lease = 0;
    std::string room;
  };
  struct Room {
    enum class State : std::uint8_t { claiming, owned, releasing };
    State state = State::claiming;
    // Is the number of our claim, in `owned` and `releasing`.
    std::int64_t claim = 0;
    // A new claim is given up at this time; zero: the room was ours, and the outcome must be known.
    std::int64_t give_up_ns = 0;
    std::int64_t try_at_ns = 0;
    // Is zero while no call is under way.
    std::uint64_t call = 0;
    // Moves with the room.
    std::string kept = {};
    // etcd may have a kept text of the room.
    bool is_kept = false;
    // What an earlier owner has kept makes the answer to a claim too long.
    bool skips_kept = false;
    // room_claimed has been taken, in `owned`.
    bool is_told = false;
    // Writes `kept`; zero: no call does.
    std::uint64_t kept_call = 0;
    // etcd may have executed a claim under this lease, in `claiming`.
    bool is_sent = false;
    // In `claiming`, false means that the room is released once the outcome is known; in `releasing`, true means that
    // it is claimed again.
    bool is_wanted = true;
  };

  struct HandOver {
    std::uint64_t to = 0;
    // The copy has shown the release first at this time; zero: not yet.
    std::int64_t released_ns = 0;
    // room_handed_over has been emitted.
    bool is_told = false;
  };

  [[nodiscard]] bool has_address() const { return !status_.address.host.empty(); }

  // Calls.
  std::uint64_t start(Purpose purpose, etcd::Request request, std::int64_t now_ns, std::string room = {});
  void stop_call(std::uint64_t id);
  void end_overdue_calls(std::int64_t now_ns);
  void turn_to_next_endpoint(const Call& call, EtcdFault fault, std::int64_t now_ns);
  void fail(const Call& call, EtcdFault fault, std::int64_t now_ns);
  void take(const Call& call, std::string_view body, std::int64_t now_ns);
  [[nodiscard]] bool is_under_way(Purpose purpose) const;

  // The lease.
  void poll_lease(std::int64_t now_ns);
  void open_fence(std::int64_t from_ns, std::int64_t lease_ns);
  void poll_status(std::int64_t now_ns);
  void note_fence(std::int64_t now_ns);
  void take_lease(const Call& call, const etcd::LeaseAnswer& answer, std::int64_t now_ns);
  [[nodiscard]] bool may_keep_alive(std::int64_t now_ns);
  void note_failed_keep_alive(const Call& call, EtcdFault fault, std::int64_t now_ns);
  void lose_lease(std::int64_t now_ns);

  // Rooms.
  void poll_rooms(std::int64_t now_ns);
  void take_claim(const Call& call, const etcd::TxnAnswer& answer, std::int64_t now_ns);
  void lose_claim(const std::string& name, std::uint64_t owner, std::string reason);
  void shorten_claim(const Call& call);
  void take_release(const Call& call, std::int64_t now_ns);
  void retry_room(const Call& call);
  void poll_hand_overs(std::int64_t now_ns);
  void begin_claim(const std::string& room, std::int64_t give_up_ns);
  void win(const std::string& name, Room& room, std::int64_t claim, const etcd::KeyValue* kept);
  void give_up(const std::string& room, std::int64_t now_ns);
  void check_room(const std::string& room, std::int64_t revision);
  void forget(const std::string& room);

  // What moves with rooms.
  void poll_kept(std::int64_t now_ns);
  [[nodiscard]] etcd::Beside kept_of(const std::string& name, const Room& room) const;
  void take_kept_lease(const Call& call, const etcd::LeaseAnswer& answer);
  void lose_kept_lease();
  void end_keep(const Call& call, bool is_done);

  // The copy of the directory.
  void poll_view(std::int64_t now_ns);
  void take_list(const etcd::RangeAnswer& answer);
  void take_watch(std::uint64_t id, const etcd::WatchAnswer& answer, std::int64_t now_ns);
  void list_again();

  void emit(FleetEvent event) {
    events_.push_back(std::move(event));
    if (on_news) on_news();
  }
  void set_gauges(std::int64_t now_ns);

  EtcdDirectoryDef def_;
  EtcdTransport* transport_;
  FleetCounters* counters_;
  FleetKeys keys_;
  Random random_;
  std::int64_t lease_ns_, request_timeout_ns_;
  // The connection of a watch that says nothing for so long may have died: a new one goes on where it ended.
  std::int64_t silence_ns_;

  std::map<std::uint64_t, Call> calls_;
  std::uint64_t last_call_ = 0;
  std::size_t endpoint_ = 0;
  // Counts the changes of endpoint_.
  std::uint64_t generation_ = 0;
  // Counts failures since the last answer.
  std::size_t failures_ = 0;
  std::int64_t retry_at_ns_ = 0;

  // Is zero while there is none.
  std::int64_t lease_ = 0;
  std::int64_t keep_alive_at_ns_ = 0;
  // ask_lease has an answer, since the last keep-alive.
  bool is_heard_ = false;
  // ask_lease had an answer first at this time since the fence has closed; zero: not yet.
  std::int64_t heard_ns_ = 0;
  // These endpoints have not answered a keep-alive since silent_from_ns_.
  std::set<std::size_t> silent_;
  std::int64_t silent_from_ns_ = 0;
  bool is_paused_ = false, is_stopping_ = false;

  ServerStatus status_;
  // Is the value of our key, as etcd has it under this lease.
  std::string told_;
  std::string telling_;
  std::int64_t tell_at_ns_ = 0;

  std::map<std::string, Room, std::less<>> rooms_;
  // These rooms need a call and have none.
  std::set<std::string> due_;
  // The `kept` of these rooms is not in etcd.
  std::set<std::string> kept_due_;
  // What is kept has this lease, which outlives this server; zero: none.
  std::int64_t kept_lease_ = 0;
  std::int64_t kept_renewal_ns_ = 0;
  std::map<std::string, HandOver, std::less<>> hand_overs_;
  std::vector<FleetEvent> events_;

  SkippedEntries skipped_;
  FleetView view_, listed_;
  bool is_listed_ = false;  // view_ has been complete once
  std::string list_from_;   // empty: no list is under way
  std::int64_t list_page_;  // entries of the next answer; 0: one key, whose value is too long
  std::uint64_t watch_ = 0;
  std::int64_t watch_until_ns_ = 0;
};

}  // namespace hairnet::server
