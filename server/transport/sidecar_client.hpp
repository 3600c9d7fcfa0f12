#pragma once

#include <memory>

#include "server/agones/sidecar_transport.hpp"
#include "server/transport/io_loop.hpp"

namespace hairnet::server {

// Carries calls to Agones' sidecar over HTTP/1.1 on the loopback, each on a connection of its own. The sidecar's caller
// decides when a call has taken too long; here each has bounds in bytes and an outer time-out. I/O thread.
class SidecarClient final : public agones::SidecarTransport {
 public:
  // The loop must outlive the client's calls.
  SidecarClient(IoLoop& loop, std::uint16_t port);
  ~SidecarClient() override;
  SidecarClient(const SidecarClient&) = delete;
  SidecarClient& operator=(const SidecarClient&) = delete;

  // Before the first call. The sink must outlive the client, or be null by then.
  void set_sink(agones::SidecarSink* sink);
  void send(std::uint64_t call, agones::Request request) override;
  void cancel(std::uint64_t call) override;

 private:
  struct Impl;
  std::shared_ptr<Impl> impl_;
};

}  // namespace hairnet::server
