#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "core/result.hpp"
#include "tests/load/stage.hpp"

namespace hairnet::load {

// Everything that is done to the server: the same plan and seed give the same arrivals, poses and misbehaviour.
struct Plan {
  std::uint64_t seed = 1;
  double pose_hz = 72;
  // Each is a file or made:STYLE. Characters take the grooms in turn.
  std::vector<std::string> grooms{"made:bob"};
  // Each is a file or made:NAME. Characters take the motions in turn.
  std::vector<std::string> motions{"made:dance", "made:look_around", "made:nod", "made:walk"};
  // Is the number of clients in a room; 0 means one room for all.
  std::uint32_t room_size = 0;
  // This share of the clients has hands, which touch and hold the hair of other clients' characters.
  double touch_share = 0;
  // Says which members each client sees: all, or a number of nearest ones. 0 means its own only.
  std::string observe = "all";
  // Is the permitted error of hair, as in wire::Observe::error_m.
  double hair_error_mm = 1;
  // Limits the bytes of frames for a client, as in wire::Observe::bytes_per_s.
  double frame_bytes_per_s = 0;
  std::vector<Stage> stages;
  // Holds thresholds of the plan itself, beside those of the command line.
  std::vector<std::string> requirements;

  [[nodiscard]] double duration_s() const;
  [[nodiscard]] bool has_attacks() const;
  // Counts from the plan's begin; one past the last stage is the end.
  [[nodiscard]] std::int64_t stage_begin_ns(std::size_t stage) const;
};

// Empty when it can be run; else one line. Gives stages of one name numbers.
std::string settle(Plan& plan);

// Parses JSON with comments: keys as the fields (`require`: requirements), `stages` a list of what parse_stage takes.
// The report that this program writes will do too: then its `plan` is taken.
Result<Plan> parse_plan(std::string_view json);
std::string to_json_text(const Plan& plan);

struct Preset {
  std::string_view name, description;
  std::string_view plan;  // JSON
};
const std::vector<Preset>& presets();
Result<Plan> preset_plan(std::string_view name);

}  // namespace hairnet::load
