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
  // Covers what is measured, without warm-up.
  double duration_s = 0;
  // Say what was used meanwhile.
  std::optional<ProcessUse> own, server;
  double server_resident_growth_mib = 0;
  // Are taken from samples twice a second; zero means that there are none.
  double server_resident_peak_mib = 0, builds_resident_peak_mib = 0;
  // Belongs to that time; null or empty means that there is none.
  const Exposition* server_metrics = nullptr;
  // Is the server's own delay.
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
