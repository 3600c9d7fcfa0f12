#pragma once

#include <memory>

#include "core/result.hpp"
#include "server/agones/sidecar.hpp"
#include "server/app/config.hpp"
#include "server/app/fleet.hpp"
#include "server/app/health.hpp"
#include "server/app/metrics.hpp"

namespace hairnet::server {

class IoLoop;
class SidecarClient;

// Reports the state of this server to Agones, and gives the fleet the address at which clients reach it, where only
// Agones knows that. I/O thread.
class Agones {
 public:
  // `port` is the value of agones::kPortVariable, or null. Null where Agones is not used; the error is one line. `loop`
  // and `metrics` must outlive it.
  static Result<std::unique_ptr<Agones>> create(const Config& config, const char* port, IoLoop& loop, Metrics& metrics);
  ~Agones();
  Agones(const Agones&) = delete;
  Agones& operator=(const Agones&) = delete;

  // Sends the sidecar the calls that are due, and gives the fleet the address once. Nothing blocks.
  void poll(const Health& health, Fleet& fleet, std::int64_t now_ns);
  // The server has drained. True once Agones knows, or does not answer.
  [[nodiscard]] bool has_shut_down(std::int64_t now_ns);

 private:
  Agones(const agones::SidecarDef& def, std::uint16_t port, IoLoop& loop, Metrics& metrics);

  std::unique_ptr<SidecarClient> client_;
  agones::Sidecar sidecar_;
  bool has_sent_address_ = false;
};

}  // namespace hairnet::server
