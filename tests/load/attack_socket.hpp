#pragma once

#include <vector>

#include "tests/load/attacker.hpp"

namespace hairnet::load {

// A socket without a session: sends fixed bytes, or none, and then waits.
struct SocketAttack {
  std::shared_ptr<const std::vector<std::uint8_t>> bytes;
  bool reads = true;
  double life_s = 60;  // until it closes itself, and comes again
};

class AttackSocket final : public Attacker {
 public:
  AttackSocket(const AttackContext& context, std::uint32_t host, SocketAttack attack);

 private:
  void begin(std::int64_t now_ns) override;
  void proceed(std::int64_t now_ns) override;

  SocketAttack attack_;
  std::size_t sent_ = 0;
  std::int64_t end_ns_ = 0;
};

}  // namespace hairnet::load
