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
  double duration_s = 0;                  // measured, without warm-up
  std::optional<ProcessUse> own, server;  // used meanwhile
  double server_resident_growth_mib = 0;
  double server_resident_peak_mib = 0, builds_resident_peak_mib = 0;  // of samples twice a second; 0: there are none
  const Exposition* server_metrics = nullptr;                         // of that time; null or empty: there are none
  double pose_delay_ms = 0;                                           // the server's own delay
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
