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
  // The number of clients in a room; 0 means one room for all.
  std::uint32_t room_size = 0;
  // This share of the clients has hands, which touch and hold the hair of other clients' characters.
  double touch_share = 0;
  // This share of the clients with hands also sets, moves and removes props of its room, if the server permits it.
  double props_share = 0;
  // Which members each client observes: "all", or the number of nearest ones, where "0" means its own characters alone.
  std::string observe = "all";
  // The permitted error of hair, as in wire::Observe::error_m but in millimetres.
  double hair_error_mm = 1;
  // The most bytes of frames for a client, as in wire::Observe::bytes_per_s.
  double frame_bytes_per_s = 0;
  std::vector<Stage> stages;
  // Thresholds of the plan itself, beside those of the command line.
  std::vector<std::string> requirements;

  [[nodiscard]] double duration_s() const;
  [[nodiscard]] bool has_attacks() const;
  // Returns the time from the begin of the plan to that of the stage. The number after the last stage gives the end of
  // the plan.
  [[nodiscard]] std::int64_t stage_begin_ns(std::size_t stage) const;
};

// Checks the plan, and adds numbers to the names of stages that have the same name. Returns one line about what is
// wrong; it is empty when the plan can be run.
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
