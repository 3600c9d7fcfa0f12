#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <memory>
#include <string>

namespace hairnet::whole {

// What happens to the packets of one direction.
struct Line {
  // Are shares of the packets. A late packet arrives after those that follow it.
  double lost = 0, repeated = 0, late = 0;
  int delay_ms = 0;
};

// Between clients and a server: passes the TCP connections and UDP packets of one address on to the same ports of
// another, the packets over bad lines. A thread of its own.
class LossyRelay {
 public:
  enum Direction { to_server, to_client };

  // Throws std::runtime_error when an address cannot be used.
  LossyRelay(const std::string& client_side, const std::string& server_side, std::uint16_t port,
             const std::array<Line, 2>& lines, std::uint64_t seed);
  ~LossyRelay();

  // From now on packets reach the server from other ports, as when clients change their network. Those of a client that
  // shakes hands do not, because QUIC allows no change meanwhile.
  void change_network();
  // All packets arrive after this call.
  void repair();
  [[nodiscard]] std::uint64_t passed(Direction direction) const { return passed_[direction]; }
  [[nodiscard]] std::uint64_t lost(Direction direction) const { return lost_[direction]; }

 private:
  struct Impl;
  std::array<std::atomic<std::uint64_t>, 2> passed_{}, lost_{};
  std::unique_ptr<Impl> impl_;
};

}  // namespace hairnet::whole
