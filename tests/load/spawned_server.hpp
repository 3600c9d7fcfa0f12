#pragma once

#include <sys/types.h>

#include <memory>
#include <string>
#include <vector>

#include "core/result.hpp"

namespace hairnet::load {

// A server of our own, on a port that it picks; stopped by SIGTERM, later by SIGKILL, when this is destroyed.
class SpawnedServer {
 public:
  // Starts `program` with its arguments, and adds --bind, --port and --port-file. Waits until it listens, 20 s at most.
  // Its output goes to the file `log`.
  static Result<std::unique_ptr<SpawnedServer>> start(const std::string& program,
                                                      const std::vector<std::string>& arguments,
                                                      const std::string& log);
  ~SpawnedServer();
  SpawnedServer(const SpawnedServer&) = delete;
  SpawnedServer& operator=(const SpawnedServer&) = delete;

  [[nodiscard]] pid_t pid() const { return pid_; }
  [[nodiscard]] std::uint16_t port() const { return port_; }
  [[nodiscard]] bool running();

 private:
  explicit SpawnedServer(pid_t pid) : pid_(pid) {}
  pid_t pid_;
  bool ended_ = false;
  std::uint16_t port_ = 0;
};

}  // namespace hairnet::load
