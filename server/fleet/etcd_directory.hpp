#pragma once

#include "server/fleet/directory.hpp"
#include "server/fleet/etcd_calls.hpp"
#include "server/fleet/etcd_copy.hpp"
#include "server/fleet/etcd_directory_def.hpp"
#include "server/fleet/etcd_entry.hpp"
#include "server/fleet/etcd_lease.hpp"
#include "server/fleet/etcd_rooms.hpp"
#include "server/fleet/etcd_transport.hpp"
#include "server/fleet/fleet_counters.hpp"

namespace hairnet::server {

// A directory in etcd. This server has one lease; its keys in etcd vanish with the lease. README.md has the rules ("How
// it works", and "Why a room never has two owners"). This class owns the parts, passes on what one part has to tell
// another, and collects events.
class EtcdDirectory final : public Directory, public EtcdSink {
 public:
  // `transport` and `counters` must outlive the directory.
  EtcdDirectory(const EtcdDirectoryDef& def, EtcdTransport& transport, FleetCounters& counters);

  // Where clients reach this server. Until it is known the directory does not join the fleet.
  void set_address(const ServerAddress& address) { entry_.set_address(address); }

  // These functions implement Directory (directory.hpp has what each promises). Most pass the call on to the part that
  // has the matter.
  [[nodiscard]] Placement where(std::string_view room, std::int64_t now_ns) const override;
  [[nodiscard]] bool holds(std::string_view room, std::int64_t now_ns) const override {
    return fence_.is_open(now_ns) && rooms_.claim_of(room) != 0;
  }
  bool claim(std::string_view room, std::int64_t now_ns) override { return rooms_.claim(room, now_ns); }
  void release(std::string_view room, std::int64_t) override { rooms_.release(room); }
  void hand_over(std::string_view room, std::uint64_t to, std::int64_t) override { rooms_.hand_over(room, to); }
  void keep(std::string_view room, std::string text, std::int64_t) override { rooms_.keep(room, std::move(text)); }
  void look_again(std::int64_t now_ns) override { copy_.look_again(now_ns); }
  void tell(const ServerLoad& load) override { entry_.tell(load); }
  void drain(std::int64_t) override { entry_.drain(); }
  void pass_on(std::vector<ContentHash> grooms) override { entry_.pass_on(std::move(grooms)); }
  void stop(std::int64_t now_ns) override;
  [[nodiscard]] bool is_stopped() const override {
    return lease_.is_ending() && lease_.id() == 0 && calls_.count() == 0;
  }
  void poll(std::int64_t now_ns) override;
  std::vector<FleetEvent> take_events() override;
  [[nodiscard]] std::uint64_t server_id() const override { return def_.server_id; }
  [[nodiscard]] bool is_reachable() const override { return calls_.is_reachable(); }
  [[nodiscard]] std::vector<ServerStatus> servers() const override;
  [[nodiscard]] std::vector<RoomOwner> rooms() const override;
  [[nodiscard]] std::vector<std::string> own_rooms() const override { return rooms_.owned(); }

  // The transport calls these three (EtcdSink in etcd_transport.hpp), on the I/O thread.
  void on_answer(std::uint64_t call, int status, std::string_view body, std::int64_t now_ns) override {
    calls_.on_answer(call, status, body, now_ns);
  }
  void on_line(std::uint64_t call, std::string_view line, std::int64_t now_ns) override {
    calls_.on_line(call, line, now_ns);
  }
  void on_error(std::uint64_t call, EtcdError error, std::int64_t now_ns) override {
    calls_.on_error(call, error, now_ns);
  }

  // For tests: calls under way, and rooms that are claimed, owned or being released.
  [[nodiscard]] std::size_t call_count() const { return calls_.count(); }
  [[nodiscard]] std::size_t room_count() const { return rooms_.count(); }

 private:
  [[nodiscard]] bool has_address() const { return !entry_.status().address.host.empty(); }
  // The callbacks of the parts: the lease is gone; the fence has closed or opened; a list of the copy is complete; the
  // entry of a server has changed.
  void on_lease_lost();
  void on_fence(bool is_open);
  void on_listed();
  void on_server(const etcd::KeyValue& entry);
  // Queues an event for take_events(), and calls on_news.
  void emit(FleetEvent event);
  void set_gauges(std::int64_t now_ns);

  // The parts, in the order of their references: apart from callbacks, each refers only to those before it.
  EtcdDirectoryDef def_;
  FleetCounters* counters_;
  EtcdCalls calls_;
  EtcdLease lease_;
  EtcdEntry entry_;
  EtcdCopy copy_;
  EtcdRooms rooms_;
  std::vector<FleetEvent> events_;
};

}  // namespace hairnet::server
