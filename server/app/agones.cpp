#include "server/app/agones.hpp"

#include <random>

#include "server/transport/sidecar_client.hpp"

namespace hairnet::server {

Result<std::unique_ptr<Agones>> Agones::create(const Config& config, const char* port, IoLoop& loop, Metrics& metrics) {
  const UseAgones use = config.fleet.agones;
  const bool asks_for_address = config.fleet.address == FleetConfig::kAddressOfAgones;
  if (use == UseAgones::off || (use == UseAgones::automatic && !port)) {
    if (asks_for_address)
      return Refusal("fleet.address is agones, but " + std::string(agones::kPortVariable) +
                     " is not set: this is no container of Agones (fleet.agones = \"on\" asks port " +
                     std::to_string(agones::kPort) + ")");
    return std::unique_ptr<Agones>();
  }
  // With fleet.agones = "on" the variable may be missing, as outside of a container; then the usual port is tried.
  const Result<std::uint16_t> number = port ? agones::parse_port(port) : agones::kPort;
  if (!number) return Refusal(number.error());
  const agones::SidecarDef def{.room_count_max = config.sessions.room_count_max,
                               .asks_for_address = asks_for_address,
                               .seed = std::random_device()()};
  return std::unique_ptr<Agones>(new Agones(def, *number, loop, metrics));
}

Agones::Agones(const agones::SidecarDef& def, std::uint16_t port, IoLoop& loop, Metrics& metrics)
    : client_(std::make_unique<SidecarClient>(loop, port)), sidecar_(def, *client_, metrics.agones) {
  client_->set_sink(&sidecar_);
}

Agones::~Agones() {
  // sidecar_ is destroyed before client_, and a call under way must not reach it.
  client_->set_sink(nullptr);
}

void Agones::poll(const Health& health, Fleet& fleet, std::int64_t now_ns) {
  // Agones and load balancers get the same answer as /readyz.
  sidecar_.poll({.takes_clients = why_not_ready(health).empty(),
                 .has_ticks_on_time = has_ticks_on_time(health),
                 .drains = health.draining,
                 .rooms = fleet.room_count()},
                now_ns);
  if (has_sent_address_ || !sidecar_.address()) return;
  // An address of Agones is for the pod's life.
  has_sent_address_ = true;
  fleet.set_address(*sidecar_.address());
}

bool Agones::has_shut_down(std::int64_t now_ns) {
  sidecar_.shut_down(now_ns);
  return sidecar_.is_shut_down(now_ns);
}

}  // namespace hairnet::server
