#pragma once

#include <cstdint>
#include <functional>
#include <string>

#include "core/groom/groom.hpp"
#include "core/levels/level.hpp"
#include "core/parallel_for.hpp"

namespace hairnet {

// Raise this number whenever the same groom gives different levels. Servers then rebuild the levels in their disk
// cache.
inline constexpr std::uint32_t kBuildVersion = 3;

// Statistics of building one level, for logs and tests.
struct LevelReport {
  // Both are counted before decimation.
  std::size_t springs_before = 0, attachments_before = 0;
  std::size_t springs_after = 0, attachments_after = 0;
  std::size_t active_nodes = 0;
  // The strands and threads without length, which get no springs.
  std::size_t degenerate_strands = 0;
  // The points of hair at which contact acts.
  std::size_t contacts = 0;
  // Times by BuildCallbacks::clock_s; 0 without a clock.
  double decimation_s = 0, total_s = 0;
};

// Callbacks of a build. Only one thread at a time calls them, also when `parallel_for` runs on many.
struct BuildCallbacks {
  // Gets the finished fraction in [0, 1] and the name of the current stage. Return false to cancel the build.
  std::function<bool(double fraction, std::string_view stage)> progress;
  // The clock for the times of the report: core reads no clock of its own.
  std::function<double()> clock_s;
};

// Builds one level. `groom` must pass validate(). Asserts that it has a point. Returns null only when cancelled. The
// result has the same bits for any `parallel_for`, whose body may call `parallel_for` again; an empty one runs
// serially.
std::shared_ptr<const Level> build_level(const Groom& groom, const LevelSpec& spec,
                                         const BuildCallbacks& callbacks = {}, LevelReport* report = nullptr,
                                         const ParallelFor& parallel_for = {});

// Builds all levels that have a lattice at the same time, then the maps between them; otherwise as build_level.
// `reports` has one entry a level.
std::shared_ptr<const LevelSet> build_levels(const Groom& groom, const BuildCallbacks& callbacks = {},
                                             std::array<LevelReport, 4>* reports = nullptr,
                                             const ParallelFor& parallel_for = {});

// Computes the maps between the levels of `set`, which were built from `groom`. A server calls it for levels from its
// disk cache, which has no maps.
void make_level_maps(const Groom& groom, LevelSet& set, const ParallelFor& parallel_for = {});

}  // namespace hairnet
