#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "server/agones/sidecar_api.hpp"

namespace hairnet::server::agones {

// Why a call has no answer.
enum class SidecarError : std::uint8_t { unreachable, timeout, broken, refused, malformed, oversize };

// Takes what the transport receives. I/O thread.
class SidecarSink {
 public:
  virtual ~SidecarSink() = default;
  // The sidecar has answered; the body may be anything of at most kAnswerBytesMax.
  virtual void on_answer(std::uint64_t call, int status, std::string_view body, std::int64_t now_ns) = 0;
  virtual void on_error(std::uint64_t call, SidecarError error, std::int64_t now_ns) = 0;
};

// Carries requests to the sidecar. It calls the sink later, never inside send() or cancel().
class SidecarTransport {
 public:
  virtual ~SidecarTransport() = default;
  // Numbers of calls are the caller's; each is used once.
  virtual void send(std::uint64_t call, Request request) = 0;
  // The sink hears no more of this call, which the sidecar may still execute.
  virtual void cancel(std::uint64_t call) = 0;
};

}  // namespace hairnet::server::agones
