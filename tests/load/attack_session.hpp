#pragma once

#include <string>
#include <vector>

#include "core/random.hpp"
#include "tests/load/attacker.hpp"

namespace hairnet::load {

// What a session does. All messages but the bad appearances keep to the protocol; the attack is their number.
struct SessionAttack {
  // What the session does after its welcome: it stays, breaks off and resumes again and again, or leaves at once.
  enum class Stay : std::uint8_t { stays, resumes, leaves };
  std::string room;
  wire::Role role = wire::Role::participant;
  std::uint32_t characters = 0;
  Stay stay = Stay::stays;
  bool promises_signs_of_life = false;
  // The rates of this struct are events a second. `pose_hz` is the rate of each character's poses.
  double pose_hz = 0;
  // Each pose differs from the one before.
  bool moves = true;
  // The session asks for its nearest members at this rate.
  double observe_hz = 0;
  // Heads ride at this speed on circles of 50 m, and stop for a second in each four.
  double ride_m_per_s = 0;
  // The session sends SetWind at this rate.
  double wind_hz = 0;
  // Each wind differs from the one before.
  bool wind_varies = true;
  // The session adds and removes characters in turn at this rate.
  double churn_hz = 0;
  // Sends SetAppearance of its characters in turn, with tags of any bytes.
  double appearance_hz = 0;
  // Sends AddCharacter and SetAppearance that a server must refuse.
  double bad_appearance_hz = 0;
  // The session reads so many bytes a second; zero means all.
  std::size_t read_bytes_per_s = 0;
};

class AttackSession final : public Attacker {
 public:
  AttackSession(const AttackContext& context, std::uint32_t host, SessionAttack attack);

 private:
  void begin(std::int64_t now_ns) override;
  void proceed(std::int64_t now_ns) override;
  void hear(const wire::Message& message, std::int64_t now_ns) override;
  void add_character(std::int64_t now_ns);
  void set_appearance(std::int64_t now_ns);
  void send_bad_appearance(std::int64_t now_ns);
  [[nodiscard]] std::string random_tag(std::size_t bytes);
  void send_poses(std::int64_t captured_ns, std::int64_t now_ns);

  SessionAttack attack_;
  Rate poses_, observes_, winds_, churn_, appearances_, bad_appearances_, reads_;
  Random random_;
  bool welcomed_ = false;
  std::uint64_t session_ = 0;
  wire::SessionSecret secret_{};
  // The session has the characters from first_ to end_ - 1.
  std::uint32_t first_ = 1, end_ = 1;
  // The number of messages of all kinds, so that each differs from the one before.
  std::uint32_t turn_ = 0;
};

}  // namespace hairnet::load
