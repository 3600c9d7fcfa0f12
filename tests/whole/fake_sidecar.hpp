#pragma once

#include <atomic>
#include <cstdint>
#include <mutex>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

namespace hairnet::whole {

// Agones' SDK server as a game server sees it: an HTTP server on the loopback that remembers what it was asked.
class FakeSidecar {
 public:
  FakeSidecar();
  ~FakeSidecar();
  FakeSidecar(const FakeSidecar&) = delete;
  FakeSidecar& operator=(const FakeSidecar&) = delete;

  [[nodiscard]] std::uint16_t port() const { return port_; }
  void set_address(const std::string& host, std::uint16_t port = 1);
  // The state changes that were asked for, in order.
  [[nodiscard]] std::vector<std::string> states() const;
  // How many requests have contained this text.
  [[nodiscard]] std::size_t count(std::string_view text) const;

  // Connections are closed at once while it is true.
  std::atomic<bool> is_away = false;

 private:
  void serve();
  void answer(int peer);

  int listener_ = -1;
  std::uint16_t port_ = 0;
  std::atomic<bool> ends_ = false;
  // Guards the next two.
  mutable std::mutex mutex_;
  std::string game_server_;
  std::vector<std::string> requests_;
  std::thread thread_;
};

}  // namespace hairnet::whole
