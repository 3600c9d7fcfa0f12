#pragma once

#include <array>
#include <cstdint>
#include <string_view>
#include <vector>

namespace hairnet::fleet_plan {

enum class HairLevel : std::uint8_t { low, half_learnt, learnt, high };
inline constexpr std::array<std::string_view, 4> kHairLevelNames{"low", "half-learnt", "learnt", "high"};

// What a server, etcd and the network take for the work that the plan counts. cost_figures() has each one's source.
struct ServerCosts {
  // Processor time, ms for each character and second. The number behind `cpu` is the size of the room in which it was
  // measured; a crowd is many characters that one client observes.
  double low_cpu_8_ms = 1.11, low_cpu_32_ms = 1.33;
  double high_cpu_8_ms = 3.6, high_cpu_32_ms = 3.6;
  double crowd_low_cpu_ms = 0.48, crowd_learnt_cpu_ms = 0.085;
  // Bytes from the server, kB for each character and second, in rooms of 8, 32 and 4 people.
  double low_8_kb = 23.2, low_32_kb = 84.6;
  double high_8_kb = 29.4, high_32_kb = 109;
  double learnt_4_kb = 6.188;
  // Memory of a server without clients, of the levels of a hairstyle, and of a session with its character.
  double process_mb = 100, hairstyle_mb = 10, session_kb = 64;
  // Times: a claim at etcd, a redirect without the network, a round trip between client and server. Loading the levels
  // of one hairstyle takes level_load_s.
  double claim_ms = 10, redirect_ms = 20, round_trip_ms = 40, connect_round_trips = 3;
  double level_load_s = 0.43;

  // Return what one character takes in a second, when `observed` members of the room are sent to its client.
  [[nodiscard]] double cpu_s(HairLevel level, double observed) const;
  [[nodiscard]] double bytes_per_s(HairLevel level, double observed) const;
  [[nodiscard]] double connect_s() const { return round_trip_ms * connect_round_trips / 1e3; }
};

// A member of ServerCosts: its flag, its unit, and where its default comes from.
struct CostFigure {
  std::string_view flag;
  double ServerCosts::*value;
  std::string_view unit, meaning, source;
  // It is false for a figure that is assumed.
  bool is_measured = true;
};
const std::vector<CostFigure>& cost_figures();

}  // namespace hairnet::fleet_plan
