#pragma once

#include <memory>
#include <vector>

#include "tests/load/groom_uploader.hpp"
#include "tests/load/requirement.hpp"
#include "tests/load/tcp_client_connection.hpp"

namespace hairnet::load {

// A user who comes during a stage with a groom of its own, and a monitor that asks for /healthz once a second.
class LateJoiner {
 public:
  // The user comes at `at_ns`, from the loopback address `host`, and speaks `protocol`. `io` and `connector` must
  // outlive the late joiner.
  LateJoiner(asio::io_context& io, Connector& connector, asio::ip::tcp::endpoint server,
             std::unique_ptr<ProtocolClient> protocol, EncodedGroom groom, std::uint32_t host, std::int64_t at_ns);
  // Call it often.
  void poll(std::int64_t now_ns);
  // Returns the times until the welcome and until the groom was ready, and the slowest answer of /healthz. Call it at
  // the end of the stage: what has not happened by then counts with the time so far.
  [[nodiscard]] Figures figures(std::int64_t now_ns) const;
  [[nodiscard]] const std::string& error() const { return uploader_.error(); }

 private:
  struct Health {
    bool waits = false;
    double max_s = 0;
  };
  void ask_for_health(std::int64_t now_ns);

  asio::io_context* io_;
  asio::ip::tcp::endpoint server_;
  std::vector<EncodedGroom> grooms_;
  GroomUploader uploader_;
  // When the user comes, was welcomed, and had the groom ready (0: not yet), and when the next /healthz is due.
  std::int64_t at_ns_, welcome_ns_ = 0, ready_ns_ = 0, health_ns_;
  // It is shared with the answers that may still come after the late joiner is destroyed.
  std::shared_ptr<Health> health_ = std::make_shared<Health>();
};

}  // namespace hairnet::load
