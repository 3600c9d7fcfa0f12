#pragma once

#include <optional>
#include <string_view>
#include <vector>

#include "tests/load/exposition.hpp"
#include "tests/load/process_sampler.hpp"
#include "tests/load/requirement.hpp"
#include "tests/load/tally.hpp"

namespace hairnet::load {

// The input for the figures of a stage.
struct StageInputs {
  const StageTally* tally = nullptr;
  // The length of the measured part, without the warm-up.
  double duration_s = 0;
  // What the generator's and the server's process have used in this time.
  std::optional<ProcessUse> own, server;
  double server_resident_growth_mib = 0;
  // The largest of the samples, which are taken twice a second; zero means that there are none.
  double server_resident_peak_mib = 0, builds_resident_peak_mib = 0;
  // The growth of the server's metrics in this time (exposition_between); null or empty means that there are none.
  const Exposition* server_metrics = nullptr;
  // The delay between a pose's capture and its use that the server itself adds (Welcome::pose_delay_ns).
  double pose_delay_ms = 0;
  std::uint64_t frames_checked = 0, check_failures = 0;
};

// The stage in numbers, by the names that requirements and the report use. A rate over nothing is left out.
Figures make_figures(const StageInputs& inputs);

// Adds to a stage with an attack how its figures differ from those of the calm stages before and after it.
void compare_with_calm(Figures& stage, const Figures& before, const Figures& after);

struct FigureName {
  std::string_view name, meaning;
};
const std::vector<FigureName>& figure_names();

}  // namespace hairnet::load
