#pragma once

#include "server/fleet/directory.hpp"

namespace hairnet::server {

// A server without a fleet: it owns every room at once, and asks nobody.
class LocalDirectory final : public Directory {
 public:
  LocalDirectory(std::uint64_t server_id, ServerAddress address);

  [[nodiscard]] Placement where(std::string_view room, std::int64_t now_ns) const override;
  [[nodiscard]] bool holds(std::string_view room, std::int64_t now_ns) const override;
  bool claim(std::string_view room, std::int64_t now_ns) override;
  void release(std::string_view, std::int64_t) override {}
  void hand_over(std::string_view, std::uint64_t, std::int64_t) override {}
  void keep(std::string_view, std::string, std::int64_t) override {}
  void tell(const ServerLoad& load) override { status_.load = load; }
  void drain(std::int64_t now_ns) override;
  void stop(std::int64_t now_ns) override;
  [[nodiscard]] bool is_stopped() const override { return fence_.until_ns() == 0; }
  void poll(std::int64_t now_ns) override;
  std::vector<FleetEvent> take_events() override;
  [[nodiscard]] std::uint64_t server_id() const override { return status_.id; }
  [[nodiscard]] bool is_reachable() const override { return true; }
  [[nodiscard]] std::vector<ServerStatus> servers() const override { return {status_}; }
  // Empty, because it keeps no list: it owns whatever is asked for.
  [[nodiscard]] std::vector<RoomOwner> rooms() const override { return {}; }
  [[nodiscard]] std::vector<std::string> own_rooms() const override { return {}; }

 private:
  ServerStatus status_;
  std::vector<FleetEvent> events_;
};

}  // namespace hairnet::server
