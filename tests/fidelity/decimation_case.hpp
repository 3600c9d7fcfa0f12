#pragma once

#include <cstddef>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "tests/fidelity/trajectory.hpp"

namespace hairnet::fidelity {

// The nodes an axis of the lattices that are compared: high, medium and low.
inline constexpr int kLatticeNodes[] = {10, 7, 5};
// Each model has a quarter as many attachments as springs.
inline constexpr std::size_t kSpringCounts[] = {1600, 800, 400, 200};
inline constexpr int kTargetNodes = 10;
// The aims below are set for this count on a lattice of kTargetNodes nodes an axis: the high level.
inline constexpr std::size_t kTargetSpringCount = 800;
inline constexpr double kMerged_rms_aim = 0.10, kRandom_ratio_aim = 2, kRandom_ratio_min = 1.4;

struct DecimationOptions {
  std::size_t point_count_max = 10'000;
  // The numbers of random subsets at the target and elsewhere.
  std::size_t target_seed_count = 5;
  std::size_t other_seed_count = 1;
};

// Distances relative to the truth's RMS motion.
struct DecimationRow {
  std::string groom, motion;
  int lattice_nodes = 0;  // an axis
  std::size_t spring_count = 0, attachment_count = 0;
  std::size_t spring_count_all = 0, attachment_count_all = 0;
  // The RMS distance of the reference from rigid motion.
  double motion_m = 0;
  // The random one is a mean over the seeds.
  Distance merged, random;
  // The distance of a model with all stiffeners, 1 % stiffer. It says how far a small error is carried.
  std::optional<double> stiffer_rms;
};

// A coarser lattice with all stiffeners against a fine one.
struct LatticeRow {
  std::string groom, motion;
  int lattice_nodes = 0, truth_nodes = 0;
  double motion_m = 0;
  Distance distance;
};

using PrintLine = std::function<void(const std::string&)>;

// All counts on all lattices, of one groom and some clips.
Result<std::vector<DecimationRow>> measure_decimation(const Groom& groom, std::span<const Clip> clips,
                                                      const DecimationOptions& options, const PrintLine& print_line);
Result<std::vector<LatticeRow>> measure_lattices(const Groom& groom, std::span<const Clip> clips, int truth_nodes,
                                                 const DecimationOptions& options, const PrintLine& print_line);

}  // namespace hairnet::fidelity
