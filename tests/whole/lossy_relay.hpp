#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <memory>
#include <string>

namespace hairnet::whole {

// What happens to the packets of one direction.
struct Line {
  // The shares of packets that get lost, come twice, or come so late that later packets overtake them. `delay_ms`
  // delays all packets.
  double lost = 0, repeated = 0, late = 0;
  int delay_ms = 0;
};

// A relay between clients and a server. It passes the TCP connections and UDP packets of one address on to the same
// port of another address. The UDP packets get lost or late as `lines` say. The relay has a thread of its own.
class LossyRelay {
 public:
  enum Direction { to_server, to_client };

  // Throws std::runtime_error when an address cannot be used.
  LossyRelay(const std::string& client_side, const std::string& server_side, std::uint16_t port,
             const std::array<Line, 2>& lines, std::uint64_t seed);
  ~LossyRelay();

  // From now on packets reach the server from other ports, as when clients change their network. A client whose
  // handshake is not over keeps its port, because QUIC allows no change during the handshake.
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
