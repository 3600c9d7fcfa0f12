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
  // Comes at `at_ns`. `protocol`: of the user. `io` must outlive this.
  LateJoiner(asio::io_context& io, Connector& connector, asio::ip::tcp::endpoint server,
             std::unique_ptr<ProtocolClient> protocol, EncodedGroom groom, std::uint32_t host, std::int64_t at_ns);
  // Call it often.
  void poll(std::int64_t now_ns);
  // The stage is over. What has not happened yet counts with its time so far.
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
  std::int64_t at_ns_, welcome_ns_ = 0, ready_ns_ = 0, health_ns_;
  std::shared_ptr<Health> health_ = std::make_shared<Health>();
};

}  // namespace hairnet::load
