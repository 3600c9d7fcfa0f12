#include "server/fleet/local_directory.hpp"

#include <utility>

#include "schema/limits.hpp"

namespace hairnet::server {

LocalDirectory::LocalDirectory(std::uint64_t server_id, ServerAddress address) {
  status_.id = server_id;
  status_.address = std::move(address);
  fence_.open_until(LeaseFence::kAlways);
}

Placement LocalDirectory::where(std::string_view, std::int64_t now_ns) const {
  if (!fence_.is_open(now_ns)) return {.kind = Placement::Kind::unavailable, .reason = "the server has stopped"};
  return {.kind = Placement::Kind::here, .server_id = status_.id, .address = status_.address};
}

bool LocalDirectory::holds(std::string_view, std::int64_t now_ns) const {
  return fence_.is_open(now_ns);
}

bool LocalDirectory::claim(std::string_view room, std::int64_t now_ns) {
  return wire::is_room_name(room) && !status_.draining && fence_.is_open(now_ns);
}

void LocalDirectory::drain(std::int64_t) {
  status_.draining = true;
}

void LocalDirectory::stop(std::int64_t) {
  fence_.close();
}

void LocalDirectory::poll(std::int64_t) {}

std::vector<FleetEvent> LocalDirectory::take_events() {
  return std::exchange(events_, {});
}

}  // namespace hairnet::server
