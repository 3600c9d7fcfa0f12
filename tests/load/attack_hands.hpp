#pragma once

#include <deque>
#include <string>
#include <vector>

#include "core/random.hpp"
#include "tests/load/attacker.hpp"

namespace hairnet::load {

// What a session does with its hands, in a room whose heads stand in rows. The rates are events a second.
struct HandsAttack {
  std::string room;
  // The session has so many characters, which everyone may touch.
  std::uint32_t characters = 0;
  // The rate of samples of hands. Each has all kHandShapesMax (32) shapes at random places and of random sizes, so the
  // hands jump, spin, and lie in heads.
  double hands_hz = 0;
  // The rate of holds and releases. The session takes hold of the hair of each member in turn. Later it lets go of the
  // hair or pins it.
  double holds_hz = 0;
  // The rate at which the session sets the room's props, which it may not, and who may touch its characters.
  double props_hz = 0;
  // The rate of hands of random bytes and of holds out of range, which a server must refuse.
  double bad_hz = 0;
};

class AttackHands final : public Attacker {
 public:
  AttackHands(const AttackContext& context, std::uint32_t host, HandsAttack attack);

 private:
  void begin(std::int64_t now_ns) override;
  void proceed(std::int64_t now_ns) override;
  void hear(const wire::Message& message, std::int64_t now_ns) override;
  void send_hands(std::int64_t captured_ns, std::int64_t now_ns);
  void send_hold(std::int64_t now_ns);
  void send_props(std::int64_t now_ns);
  void send_bad(std::int64_t now_ns);
  [[nodiscard]] Vec3 any_place();

  HandsAttack attack_;
  Random random_;
  Rate hands_, holds_, props_, bad_;
  bool welcomed_ = false;
  // turn_ counts messages of all kinds, so that each differs from the one before. holds_taken_ counts holds.
  std::uint32_t turn_ = 0, holds_taken_ = 0;
  std::vector<std::uint32_t> members_;
  std::deque<wire::TakeHold> held_;
};

}  // namespace hairnet::load
