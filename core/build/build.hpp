#pragma once

#include <cstdint>
#include <functional>
#include <string>

#include "core/build/level.hpp"
#include "core/groom/groom.hpp"
#include "core/parallel_for.hpp"

namespace hairnet {

// Raised whenever the same groom gives other levels than before: levels kept on disk are then built anew.
inline constexpr std::uint32_t kBuildVersion = 2;

// Counts of one level's making, for people and tests.
struct LevelReport {
  std::size_t springs_before = 0, attachments_before = 0;  // before decimation
  std::size_t springs_after = 0, attachments_after = 0;
  std::size_t active_nodes = 0;
  std::size_t degenerate_strands = 0;    // or threads: no points, one point, or no length: no mechanics
  std::size_t contacts = 0;              // points of hair at which contact acts
  double decimation_s = 0, total_s = 0;  // given by the caller's clock, 0 without one
};

// Asked by one thread at a time, of all that `parallel_for` runs.
struct BuildObserver {
  // Fraction in [0, 1] done and what is being done now; return false to cancel (the build then returns early).
  std::function<bool(double fraction, std::string_view stage)> progress;
  std::function<double()> clock_s;  // for the times of the report; core reads no clock of its own
};

// `groom` must be sound (validate). Needs at least one point. Returns null only when cancelled. The same groom gives
// the same bits for any `parallel_for`, whose body must be free to call it again; empty: one after the other.
std::shared_ptr<const Level> build_level(const Groom& groom, const LevelSpec& spec, const BuildObserver& observer = {},
                                         LevelReport* report = nullptr, const ParallelFor& parallel_for = {});

std::shared_ptr<const LevelSet> build_levels(const Groom& groom, const BuildObserver& observer = {},
                                             std::array<LevelReport, 4>* reports = nullptr,
                                             const ParallelFor& parallel_for = {});

// Makes the maps between levels that were built of `groom` before.
void connect_levels(const Groom& groom, LevelSet& set, const ParallelFor& parallel_for = {});

}  // namespace hairnet
