#pragma once

#include <vector>

#include "tests/load/attacker.hpp"

namespace hairnet::load {

// A connection without a session: it sends fixed bytes, or none, and then waits.
struct SocketAttack {
  std::shared_ptr<const std::vector<std::uint8_t>> bytes;
  bool reads = true;
  // The socket closes its connection after this time, and connects again.
  double life_s = 60;
};

class AttackSocket final : public Attacker {
 public:
  AttackSocket(const AttackContext& context, std::uint32_t host, SocketAttack attack);

 private:
  void begin(std::int64_t now_ns) override;
  void proceed(std::int64_t now_ns) override;

  SocketAttack attack_;
  // The number of bytes that were sent, and the end of life_s.
  std::size_t sent_ = 0;
  std::int64_t end_ns_ = 0;
};

}  // namespace hairnet::load
