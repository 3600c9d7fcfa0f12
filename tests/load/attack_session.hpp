#pragma once

#include <string>
#include <vector>

#include "core/random.hpp"
#include "tests/load/attacker.hpp"

namespace hairnet::load {

// What a session does. It keeps to the protocol and does too much of it, except with bad appearances.
struct SessionAttack {
  // Says what it does after its welcome; one that resumes does so at once.
  enum class Stay : std::uint8_t { stays, resumes, leaves };
  std::string room;
  wire::Role role = wire::Role::participant;
  std::uint32_t characters = 0;
  Stay stay = Stay::stays;
  bool promises_signs_of_life = false;
  // Counts poses a second of each character.
  double pose_hz = 0;
  // Says whether its poses differ.
  bool moves = true;
  // Observes the nearest members so often.
  double observe_hz = 0;
  // Heads ride at this speed on circles of 50 m, and stop for a second in each four.
  double ride_m_per_s = 0;
  // Sends SetWind so often.
  double wind_hz = 0;
  // Says whether the winds differ.
  bool wind_varies = true;
  // Characters are added and removed in turn so often.
  double churn_hz = 0;
  // Sends SetAppearance of its characters in turn, with tags of any bytes.
  double appearance_hz = 0;
  // Sends AddCharacter and SetAppearance that a server must refuse.
  double bad_appearance_hz = 0;
  // Limits what it reads; zero reads all.
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
  std::uint32_t first_ = 1, end_ = 1;  // the characters that it has
  std::uint32_t turn_ = 0;             // counts poses, winds and so on, so that they differ
};

}  // namespace hairnet::load
